# SPDX-License-Identifier: MIT
"""Reads a recording of a ball of 162 nodes that is pushed, beside a resting plane, and checks that it
is what the design says: see recorder_h5py.sh."""
import sys

import h5py
import numpy


def text(value):
    """Short texts have a fixed length, which h5py gives as bytes."""
    return value.decode() if isinstance(value, bytes) else value


with h5py.File(sys.argv[1], "r") as file:
    assert text(file.attrs["format"]) == "pliant-recording"
    assert text(file.attrs["created_by"]).startswith("pliant-record ")
    assert text(file.attrs["scene"]).startswith("scene h5py")
    assert file.attrs["ended"] == 1
    ball = file["bodies/ball"]
    assert all(ball.attrs[name] == 0 for name in ("dropped", "without_mesh", "refused"))
    frames = {name: ball["frames"][name][:] for name in ("time", "step", "topology", "first", "count")}
    assert len(frames["time"]) >= 5
    assert (frames["count"] == 162).all() and (numpy.diff(frames["step"]) > 0).all()
    # A tick is 2 ms; the rounding of a product.
    assert numpy.allclose(frames["time"], 0.002 * frames["step"], rtol=0, atol=1e-12)
    position = ball["position"]
    assert position.dtype == numpy.float32 and text(position.attrs["unit"]) == "m"
    # Frames in which nothing moved share rows.
    assert position.shape == (frames["first"].max() + 162, 3)
    assert (numpy.diff(frames["first"]) >= 0).all() and (frames["first"] % 162 == 0).all()
    assert numpy.isfinite(position[:]).all()
    at = [position[first:first + count] for first, count in zip(frames["first"], frames["count"])]
    assert (at[0] != at[-1]).any()
    topology = ball["topology"]
    first, count = topology["first"][0], topology["count"][0]
    triangles = ball["triangles"][first:first + count]
    assert triangles.shape == (320, 3) and triangles.min() == 0 and triangles.max() == 161
    assert sorted(ball["node_id"][:]) == list(range(162))
    assert len(file["tools/4/time"]) >= 5
    assert (file["tools/4/orientation"][:] == [1.0, 0.0, 0.0, 0.0]).all()
    assert set(file["events"].dtype.names) == {"time", "step", "body", "kind", "text"}
print("h5py", h5py.__version__, "reads", len(frames["time"]), "frames")
