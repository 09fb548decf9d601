#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A front end in Python, on the types that `lcm-gen -p lcmtypes/*.lcm` makes: what touch.c does.

    PYTHONPATH=FOLDER-OF-THE-TYPES touch.py BODY X Y Z DX DY DZ
"""
import math
import os
import sys
import time

try:
    from lcm import LCM
except ImportError:
    from liblcm import LCM

from pliant.contact_t import contact_t
from pliant.nodes_t import nodes_t
from pliant.tool_pose_t import tool_pose_t

if len(sys.argv) != 8:
    sys.exit("usage: touch.py BODY X Y Z DX DY DZ")
body, start, way = sys.argv[1], [float(x) for x in sys.argv[2:5]], [float(x) for x in sys.argv[5:8]]
newest = {"contact": contact_t(), "node": (0.0, 0.0, 0.0)}
newest["contact"].position = newest["contact"].force = (0.0, 0.0, 0.0)


def on_contact(_, data):
    contact = contact_t.decode(data)
    if contact.tool == 1:  # one channel for all tools
        newest["contact"] = contact


def on_nodes(_, data):
    nodes = nodes_t.decode(data)  # one chunk: num_values / 3 nodes from `first` on
    if nodes.first == 0 and nodes.num_values >= 3:
        newest["node"] = nodes.position[:3]


lcm = LCM()  # LCM_DEFAULT_URL
lcm.subscribe("PLIANT_CONTACT", on_contact)
lcm.subscribe("PLIANT_NODES_" + body, on_nodes)

pose = tool_pose_t()
pose.sender, pose.tool, pose.orientation, pose.active = os.getpid(), 1, [1.0, 0.0, 0.0, 0.0], True
period = 0.005  # [s]: 200 poses a second are enough for the eye
for pose.sequence in range(801):
    share = 0.5 - 0.5 * math.cos(2 * math.pi * pose.sequence / 800)  # 0, 1, 0 of the way
    pose.position = [start[k] + share * way[k] for k in range(3)]
    pose.active = pose.sequence < 800  # the last one withdraws the tool
    pose.utime = int(time.time() * 1e6)
    lcm.publish("PLIANT_TOOL_POSE", pose.encode())
    due = time.monotonic() + period
    # Everything that comes until the next pose, so that nothing grows old in LCM's queues.
    while lcm.handle_timeout(1 if time.monotonic() < due else 0) or time.monotonic() < due:
        pass
    if pose.sequence % 20 == 0:
        felt = newest["contact"]
        numbers = (*felt.position, *felt.force, *newest["node"])
        form = "tool %6.3f %6.3f %6.3f m  force %6.3f %6.3f %6.3f N  node 0 %6.3f %6.3f %6.3f m"
        print(form % numbers)
