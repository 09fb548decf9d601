#!/bin/sh
# SPDX-License-Identifier: MIT
# A recording as Python's h5py sees it. recorder_h5py.sh PLIANTD PLIANT_RECORD
set -u
for python in python3 /usr/bin/python3; do
    if "$python" -c 'import h5py' 2>/dev/null; then break; fi
    python=
done
if [ -z "$python" ]; then
    echo "skipped: h5py is not installed (python3-h5py)"
    exit 77
fi
daemon=
folder=$(mktemp -d) || exit 1
trap '[ -n "$daemon" ] && kill "$daemon" && wait "$daemon"; rm -rf "$folder"' EXIT
cat >"$folder/scene.cfg" <<SCENE
name = "h5py"; rate_hz = 500.0;
publish = { nodes_hz = 60.0; mesh_hz = 5.0; contact_hz = 60.0; status_hz = 20.0; };
bodies = ( { name = "ball"; model = "surface"; shape = {};
    mesh = { generator = "ico_sphere"; nodes = 162; radius = 0.05; }; } );
tools = ( { id = 4; kind = "static"; plane = { point = [0.0, 0.0, -0.2]; normal = [0.0, 0.0, 1.0]; }; } );
loads = ( { body = "ball"; center = [0.0, 0.0, 0.05]; radius = 0.03; force = [0.1, 0.0, -0.2];
    start = 0.05; duration = 60.0; } );
SCENE
"$1" --log-level error "$folder/scene.cfg" >"$folder/daemon.log" 2>&1 &
daemon=$!
"$2" -o "$folder/run.h5" --duration 1 --wait 60 || exit 1
"$python" "$(dirname "$0")/recorder_h5py.py" "$folder/run.h5"
