#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Reads positions in packets (publish.positions = "packets" or "both") and prints, frame by frame, how many packets
and nodes came and where node 0 is; where floats come too, also by how much the two differ at most. On the types that
`lcm-gen -p lcmtypes/*.lcm` makes.

    PYTHONPATH=FOLDER-OF-THE-TYPES points.py BODY FRAMES
"""
import sys

try:
    from lcm import LCM
except ImportError:
    from liblcm import LCM

from pliant.nodes_t import nodes_t
from pliant.points_t import points_t


def positions(packet):
    """The nodes first, first + 1, ... of a packet: a list of x y z [m]."""
    bits = int.from_bytes(packet.data, "big")
    left = 8 * packet.num_bytes

    def read(width):
        nonlocal left
        left -= width
        return bits >> left & ((1 << width) - 1)

    at, nodes = list(packet.origin), []
    for i in range(packet.count):
        if i % 8 == 0:
            width = [read(5) for _ in range(3)]
        for k in range(3):
            u = read(width[k])
            at[k] += u // 2 if u % 2 == 0 else -(u + 1) // 2
        nodes.append([packet.grid * c for c in at])
    return nodes


if len(sys.argv) != 3:
    sys.exit("usage: points.py BODY FRAMES")
body, frames = sys.argv[1], int(sys.argv[2])
node = {}  # slot: its newest position; what was lost stays as it was
floats = {}  # likewise, by sequence and slot
seen = {"sequence": None, "packets": 0, "nodes": 0, "off": 0.0, "frames": 0}


def on_points(_, data):
    packet = points_t.decode(data)
    if packet.sequence != seen["sequence"]:
        if seen["sequence"] is not None:
            print("frame %d: %d packets, %d of %d nodes, node 0 at %.5f %.5f %.5f, off by %.2g m at most" % (
                seen["sequence"], seen["packets"], seen["nodes"], packet.node_count, *node.get(0, (0, 0, 0)),
                seen["off"]))
            seen["frames"] += 1
        seen.update(sequence=packet.sequence, packets=0, nodes=0, off=0.0)
    for i, x in enumerate(positions(packet), packet.first):
        node[i] = x
        exact = floats.get((packet.sequence, i), x)
        seen["off"] = max([seen["off"]] + [abs(a - b) for a, b in zip(x, exact)])
    seen["packets"] += 1
    seen["nodes"] += packet.count


def on_nodes(_, data):
    chunk = nodes_t.decode(data)
    if chunk.chunk == 0:
        floats.clear()
    for i in range(chunk.num_values // 3):
        floats[chunk.sequence, chunk.first + i] = chunk.position[3 * i:3 * i + 3]


lcm = LCM()  # LCM_DEFAULT_URL
lcm.subscribe("PLIANT_POINTS_" + body, on_points)
lcm.subscribe("PLIANT_NODES_" + body, on_nodes)
while seen["frames"] < frames:
    lcm.handle_timeout(1000)
