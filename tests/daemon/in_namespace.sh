#!/bin/sh
# SPDX-License-Identifier: MIT
# Runs a command in a private network with multicast on its loopback device: messages of a test reach
# no other program. Exit code 77 (skipped) where that is not permitted; all else that fails is a failure.
if [ "$(id -u)" = 0 ]; then unshare="unshare -n"; else unshare="unshare -rn"; fi
if ! $unshare true 2>/dev/null; then
    echo "skipped: a private network (unshare -n) is not permitted here"
    exit 77
fi
exec $unshare sh -c '
    ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo || {
        echo "cannot set up the private network (Debian: iproute2)"
        exit 1
    }
    exec "$@"' sh "$@"
