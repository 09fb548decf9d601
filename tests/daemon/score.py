# SPDX-License-Identifier: MIT
"""Checks the score sheets of score.sh against what pliant-probe logged and what was cut."""

import csv
import html.parser
import json
import math
import re
import sys

folder = sys.argv[1]
failures = 0


def expect(what, actual, expected, tolerance):
    global failures
    if actual is None or not abs(actual - expected) <= tolerance:
        print(f"{what}: {actual}, expected {expected} within {tolerance}")
        failures += 1


def expect_between(what, actual, low, high):
    expect(what, actual, (low + high) / 2, (high - low) / 2)


class Page(html.parser.HTMLParser):
    """Notes what a page would load, and whether its elements are closed."""

    def __init__(self):
        super().__init__()
        self.foreign, self.open = [], []

    def handle_starttag(self, tag, attributes):
        self.foreign += [a for a in attributes if a[0] in ("src", "href", "srcset")]
        if tag in ("script", "link", "img", "iframe"):
            self.foreign.append(tag)
        if tag not in ("meta", "path", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        while self.open and self.open.pop() != tag:
            pass


# What the probe felt, a thousand times a second.
rows = [line.split() for line in open(f"{folder}/probe.log") if not line.startswith("#")]
time = [float(row[1]) for row in rows]
force = [math.hypot(*map(float, row[5:8])) for row in rows]
place = [tuple(map(float, row[2:5])) for row in rows]
pairs = range(1, len(rows))
integral = sum((time[i] - time[i - 1]) * (force[i] + force[i - 1]) / 2 for i in pairs)
above = sum(time[i] - time[i - 1] for i in pairs if force[i] > 0.05)
path = sum(math.dist(place[i], place[i - 1]) for i in pairs)
peak = max(force)
print(f"the probe: peak {peak:.6g} N, {integral:.6g} N s, {above:.4g} s above, path {path:.6g} m")
assert peak > 0.1 and above > 0.2

# The server's file has every tick; the log lacks contacts that were lost on a busy machine. There
# poses come late, too: the tool then goes on, and back, so its path is longer than that of the poses.
# The file from the network has a row per frame: of a force that trembles so it has a sample.
for name, share, most in (("server", 0.03, 1.5), ("network", 0.5, 1.0 + 1e-6)):
    sheet = json.load(open(f"{folder}/{name}.json"))
    tool = next(tool for tool in sheet["tools"] if tool["id"] == 1)
    expect_between(f"{name}: peak", tool["peak_force_n"], (1 - share) * peak, most * peak)
    expect(f"{name}: integral", tool["force_time_n_s"], integral, share * integral)
    expect(f"{name}: time above", tool["over_limit_s"], above, 0.002 + share * above)
    expect_between(f"{name}: path", tool["path_m"], (0.95 - share) * path, 3.0 * path)
    # From here on no figure depends on the machine.
    peak = tool["peak_force_n"]
    # The sheet was cut along its whole width of 0.1 m, from y = -0.05 m; nodes are in single
    # precision.
    body = {body["name"]: body for body in sheet["bodies"]}
    flat, block = body["sheet"], body["block"]
    expect(f"{name}: sheet", flat["severed_m"], 0.1, 1e-7)
    expect(f"{name}: sheet inside", flat["severed_inside_m"], 0.051, 1e-7)
    expect(f"{name}: pieces", flat["pieces_last"], 2, 0)
    expect(f"{name}: removed", flat["removed_m2"], 0.03 * 0.1, 1e-8)
    # The block was cut at the cells' faces nearest to x = 12 mm; the walls' nodes come from the
    # inside and are displaced as their neighbours, to a few hundredths.
    expect(f"{name}: block", block["severed_m2"], 0.1 * 0.1, 3e-4)
    expect(f"{name}: block inside", block["severed_inside_m2"], 0.1 * 0.05, 5e-4)
    expect(f"{name}: block pieces", block["pieces_last"], 2, 0)
    # Both halves are fixed, which a file of pliant-record does not know.
    expect(f"{name}: block removed", block["removed"], 1 if name == "network" else 0, 0)
    kinds = [cut["kind"] for cut in sheet["cuts"]]
    if kinds != ["cut", "cut"]:
        print(f"{name}: cuts are {kinds}")
        failures += 1
    # The other two files say the same.
    table = {
        (row["subject"], row["name"], row["measure"]): row["value"]
        for row in csv.DictReader(open(f"{folder}/{name}.csv"))
    }
    expect(f"{name}: CSV", float(table["tool", "1", "peak_force_n"]), tool["peak_force_n"], 0)
    expect(f"{name}: CSV", float(table["body", "sheet", "severed"]), flat["severed_m"], 0)
    page = Page()
    page.feed(open(f"{folder}/{name}.html").read())
    if page.foreign or page.open:
        print(f"{name}: the page has {page.foreign}, open {page.open}")
        failures += 1
# The ledger is the same, digit for digit, as recorded by the server, over the network, and by a run
# of the log, but for times: the network was recorded for less long, the log ends with its inputs.
# Five of the block's eight layers are on the side of more fixed corners.
ledger = {
    name: re.sub(r'"time_s": [^,]*', "", open(f"{folder}/{name}.json").read().split('"ledger":')[1])
    for name in ("server", "network", "again")
}
for name in ("network", "again"):
    if ledger[name] != ledger["server"]:
        print(f"the ledger of {name} is another one: {ledger[name]}\n{ledger['server']}")
        failures += 1
sheet = json.load(open(f"{folder}/server.json"))
block = next(tissue for tissue in sheet["ledger"]["tissues"] if tissue["body"] == "block")
section = next(body for body in sheet["ledger"]["sections"] if body["body"] == "block")
far = sheet["ledger"]["regions"][0]
expect("ledger: at load", block["at_load_m3"], 1e-3, 1e-15)
expect("ledger: attached", block["attached_m3"], 5e-3 / 8, 1e-15)
expect("ledger: cut off", block["cut_off_m3"], 3e-3 / 8, 1e-15)
expect("ledger: grams", block["cut_off_kg"], 3.0 / 8, 1e-12)
# A blade that passes at right angles; where it met links is known to a hundredth of a cell, and the
# nearest four are half a cell beside the ball's middle, in both directions.
expect("ledger: section", section["cut_m2"], 0.1 * 0.1, 1e-5)
expect("ledger: distance", far["distance_m"], math.hypot(0.042, 0.00625, 0.00625) - 0.01, 1.25e-4)
if (far["by"], far["touched"], far["kept"]) != ("cut", False, False):
    print(f"ledger: {far}")
    failures += 1
# The probe and the blade were in the upper half of what the region covers, for a while.
half = {name: json.load(open(f"{folder}/{name}.json"))["ledger"]["regions"][1]["time_s"] for name in ledger}
expect("ledger: time", half["again"], half["server"], 1e-9)
expect_between("ledger: time", half["server"], 0.3, tool["time_s"] + 10.0)
# Unless the scene is named.
block = json.load(open(f"{folder}/named.json"))["bodies"][0]
expect("named: block removed", block["removed"], 0, 0)
sys.exit(failures > 0)
