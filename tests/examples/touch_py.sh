#!/bin/sh
# SPDX-License-Identifier: MIT
# The same for the example in Python, on types made as its head says: touch_py.sh LCM-GEN TOP PLIANTD
# PLIANT-MONITOR SCENE. Skipped (77) without python3 or the C library that it calls.
lcm_gen=$1 top=$2
shift 2
if ! python3 -c 'import ctypes; ctypes.CDLL("liblcm.so.1")' 2>/dev/null; then
    echo "skipped: no python3 with ctypes, or no liblcm.so.1"
    exit 77
fi
PYTHONPATH=$(mktemp -d) || exit 1
PYTHONDONTWRITEBYTECODE=1
export PYTHONPATH PYTHONDONTWRITEBYTECODE
trap 'rm -rf "$PYTHONPATH"' EXIT
"$lcm_gen" -p --ppath "$PYTHONPATH" "$top"/lcmtypes/*.lcm || exit 1
sh "$(dirname "$0")/touch.sh" "$@" python3 "$top/clients/examples/touch.py"
