# SPDX-License-Identifier: MIT
"""The Python module against a real server that steps tests/examples/touch.cfg, as LCM_DEFAULT_URL has it, with
and without numpy: `live.py plain` hides it. RECORDING names a recording of the same scene."""
import os
import signal
import sys

if sys.argv[1:] == ["plain"]:
    sys.modules["numpy"] = None  # importing it fails now

import pliant

assert (pliant.numpy is None) == (sys.argv[1:] == ["plain"])


def rows(view):
    return view.tolist()


def fails(text, call, *arguments, **named):
    try:
        call(*arguments, **named)
    except pliant.Error as error:
        assert text in str(error), "%r does not say %r" % (str(error), text)
        return
    raise AssertionError("%s should fail" % text)


fails("prefix 'no prefix'", pliant.Client, prefix="no prefix")
client = pliant.Client()
assert client.body("ball") is None and client.contact(1) is None
first = client.wait_body("ball", 60.0)
assert client.bodies == ["ball"] and first.name == "ball" and first.node_count == 162
assert len(first.position) == 162 and len(rows(first.position)[0]) == 3
assert [list(row) for row in first.position] == [list(row) for row in rows(first.position)]
assert list(first.position[-1]) == [first.position[161, k] for k in range(3)] and len(first.position[:2]) == 2
assert all(0 <= corner < 162 for triangle in rows(first.triangle) for corner in triangle)
assert rows(first.id) == rows(first.origin) and set(rows(first.piece)) == {0} and set(rows(first.level)) == {0}
assert first.color is None and first.inside is None  # the scene names none
try:
    first.position[0, 0] = 0.0
    raise AssertionError("a frame can be written to")
except (TypeError, ValueError):
    pass

# A press: y goes from 55 to 40 mm, onto node 0 at 43 mm. What was kept does not move with the body.
before, kept = rows(first.position), first.position
del first
haptic, force = pliant.Haptic(3.3), (0.0, 0.0, 0.0)
for k in range(500):
    place = (-0.026, 0.055 - 3e-5 * k, 0.0)
    client.pose(1, place, linear=(0.0, -0.015, 0.0))
    client.wait(0.002)
    haptic.take(client.contact(1))
    force = haptic.force(place)
pressed, felt = client.wait_body("ball", 60.0), client.contact(1)
assert felt.contact and felt.force[1] > 0.02, felt
assert 0.0 < force[1] <= 3.3 and haptic.energy > -1e-3, (force, haptic.energy)
assert rows(kept) == before and min(p[1] for p in rows(pressed.position)) < 0.0
assert rows(pressed.position)[0][1] < before[0][1] - 0.002
fails("orientation has length", client.pose, 1, place, (2.0, 0.0, 0.0, 0.0))

# How far that may be from the truth: the probe still pushes, and is what the server holds it to be.
errors = client.wait_errors(60.0)
while not errors.tools or errors.tools[0].error < 0.0:
    client.pose(1, place)
    errors = client.wait_errors(60.0)
assert client.errors.step >= errors.step and [body.body for body in errors.bodies] == ["ball"]
assert errors.bodies[0].space > 0.0 and 0 <= errors.bodies[0].age < 100 and errors.bodies[0].relative > 0.0
assert errors.bodies[0].total >= errors.bodies[0].space and errors.bodies[0].steps >= -1.0
assert errors.tools[0].tool == 1 and 0.02 < errors.tools[0].force < 3.3
assert abs(errors.tools[0].error - errors.tools[0].share * errors.tools[0].force) < 1e-9

# What was felt was asked for, a moment before.
assert client.contact_trip(1) >= 0.0 and client.contact_trip(2) < 0.0
assert 0.0 < client.round_trip(0.0) <= client.round_trip(0.5) < 1.0
assert [contact.tool for contact in client.contacts] == [1]

# The server, as it says and as it is found.
status = client.wait_status(60.0)
assert [body.name for body in status.bodies] == ["ball"] and status.bodies[0].nodes == 162
assert len(status.step_us) == 4 and sum(status.stages.values()) > 0.0
assert client.refusal is None and client.scene_bodies() == ["ball"]
assert [(server.prefix, server.rate_hz) for server in pliant.servers()] == [("PLIANT", 100.0)]

# Requests, and what is refused.
assert "body ball" in client.describe()
reply = client.command(pliant.STEP, 10)
assert client.command(pliant.STEP, 5).step == reply.step + 5
fails("the server is in lockstep", client.wait_body, "ball", 1.0)
fails("the daemon refuses", client.command, pliant.SET, argument="gravity=up")
client.load((0.0, 0.05, 0.0), 0.02, (0.0, 0.01, 0.0), 0.1, body="ball")
fails("max_ties", client.tie, pliant.PIN, center=(0.0, 0.05, 0.0), radius=0.02)
fails("spleen", client.cut, ((0, 0, 0), (0, 0, 1)), ((1, 0, 0), (1, 0, 1)), body="spleen")
client.bind()
begun = [client.cut_begin(((0, 0, 0), (0, 0, 1)), ((1, 0, 0), (1, 0, 1)), body=body) for body in ("ball", "spleen")]
answers = {}
while client.in_progress:
    client.wait_next(10.0)
    answers.update((answer.request, answer) for answer in client.answers())
assert sorted(answers) == sorted(begun) and all(answer.answered and not answer.done for answer in answers.values())
assert "not cuttable" in answers[begun[0]].reply.text and "spleen" in answers[begun[1]].reply.text
assert client.wait_next(10.0)
try:
    client.cut(((0, 0), (0, 0, 1)), ((1, 0, 0), (1, 0, 1)))
    raise AssertionError("two numbers are no point")
except ValueError:
    pass
assert client.status.state in ("running", "lockstep") and client.status.rate_hz == 100.0
client.wait(0.2)
assert any(event.kind == "refused" for event in client.events()), "no event of what was refused"
assert client.body(None) is None
fails("none has such a name", client.wait_body, None)


# A signal ends a wait, so that Ctrl-C does.
class Rung(Exception):
    pass


def ring(*_):
    raise Rung


signal.signal(signal.SIGALRM, ring)
signal.setitimer(signal.ITIMER_REAL, 0.1)
try:
    client.wait(600.0)
    raise AssertionError("a signal does not end a wait")
except Rung:
    pass
client.stop()
fails("interrupted", client.wait, 600.0)
client.close()
fails("closed", client.wait, 0.0)
assert rows(kept) == before  # frames outlive the client

path = os.environ.get("RECORDING")
if path:
    fails("none.h5", pliant.Recording, "none.h5")
    with pliant.Recording(path) as recording:
        assert recording.bodies == ["ball"] and recording.frames("ball") > 5
        frame = recording.frame("ball", recording.find("ball", 0.3))
        assert 0.2 < frame.time <= 0.3 and frame.node_count == 162 and frame.piece is None
        assert rows(frame.triangle) == rows(pressed.triangle) and len(rows(frame.position)) == 162
        assert list(recording.events()) is not None and recording.tool(1) == []
        fails("has no frame", recording.frame, "ball", 10**6)
print("done,", "with numpy" if pliant.numpy else "without numpy")
