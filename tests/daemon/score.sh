#!/bin/sh
# SPDX-License-Identifier: MIT
# A session over LCM - cuts by message and by a blade, a press - recorded by the server and over the
# network, and its score sheets, checked by score.py. score.sh FOLDER_OF_PROGRAMS
set -u
programs=$1
daemon=
recorder=
folder=$(mktemp -d) || exit 1
trap 'for one in $daemon $recorder; do kill "$one" && wait "$one"; done; rm -rf "$folder"' EXIT
cat >"$folder/scene.cfg" <<SCENE
name = "score";
bodies = (
  { name = "sheet"; mesh = { generator = "sheet"; columns = 21; rows = 21; width = 0.1; height = 0.1; };
    cuttable = true; shape = {}; },
  { name = "block"; model = "voxel"; cuttable = true;
    voxels = { generator = "box"; count = 8; size = 0.0125; place = { translation = [0.0, 0.3, 0.0]; }; };
    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0499]); } ); } );
tools = ( { id = 1; kind = "probe"; capsules = ( { radius = 0.01; } ); },
          { id = 2; kind = "blade"; edge = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.2]); } );
score = { force_limit = 0.05;
          regions = ( { name = "far"; sphere = [-0.03, 0.3, 0.0]; radius = 0.01; margin = 0.05; }, { name = "half"; box = ([-1.0, -0.001, -1.0], [1.0, 0.3, 1.0]); } ); };
SCENE
"$programs/pliantd" --log-level error --record "$folder/server.h5" --record-tools-hz 1000 \
    --log-inputs "$folder/inputs.log" "$folder/scene.cfg" >"$folder/daemon.log" 2>&1 &
daemon=$!
"$programs/pliant-record" -o "$folder/network.h5" --wait 60 >"$folder/recorder.log" 2>&1 &
recorder=$!
# The first frame is the reference shape: it must be there before the first cut.
while ! grep -q "network.h5" "$folder/recorder.log"; do
    kill -0 "$recorder" || exit 1
    sleep 0.1
done
"$programs/pliant-cut" --quiet --body sheet --plane 0.02,0,0,1,0,0 || exit 1
"$programs/pliant-cut" --quiet --stroke --tool 2 --speed 0.2 --blade 0,0,0.2 --point 0.012,0.24,-0.1 \
    --point 0.012,0.36,-0.1 || exit 1
"$programs/pliant-probe" --press -0.01,0.3,0.065 --depth 0.02 --speed 0.05 --hold 0.5 \
    --log "$folder/probe.log" >"$folder/probe.txt" || exit 1
kill "$recorder" && wait "$recorder"
recorder=
kill "$daemon" && wait "$daemon"
daemon=
"$programs/pliantd" --offline 600 --input "$folder/inputs.log" --record "$folder/again.h5" \
    "$folder/scene.cfg" >"$folder/again.log" 2>&1
for file in server network again; do
    "$programs/pliant-play" --score "$folder/$file" "$folder/$file.h5" || exit 1
done
"$programs/pliant-play" --score "$folder/named" --score-scene "$folder/scene.cfg" "$folder/network.h5" \
    >"$folder/named.txt" || exit 1
python3 "$(dirname "$0")/score.py" "$folder"
