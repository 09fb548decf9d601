"""Checks the score sheets of score.sh against what pliant-probe logged and what was cut."""

import csv
import html.parser
import json
import math
import sys

folder = sys.argv[1]
failures = 0


def expect(what, actual, expected, tolerance):
    global failures
    if actual is None or not abs(actual - expected) <= tolerance:
        print(f"{what}: {actual}, expected {expected} within {tolerance}")
        failures += 1


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

# The server's file has every tick; that of the network a row per frame, which misses short peaks.
for name, share in (("server", 2e-3), ("network", 5e-2)):
    sheet = json.load(open(f"{folder}/{name}.json"))
    tool = next(tool for tool in sheet["tools"] if tool["id"] == 1)
    expect(f"{name}: peak", tool["peak_force_n"], peak, share * peak)
    expect(f"{name}: integral", tool["force_time_n_s"], integral, 2 * share * integral)
    expect(f"{name}: time above", tool["over_limit_s"], above, 0.002 + share * above)
    expect(f"{name}: path", tool["path_m"], path, share * path)
    expect(f"{name}: times above", tool["over_limit_count"], 1, 1 if name == "network" else 2)
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
# Unless the scene is named.
block = json.load(open(f"{folder}/named.json"))["bodies"][0]
expect("named: block removed", block["removed"], 0, 0)
sys.exit(failures > 0)
