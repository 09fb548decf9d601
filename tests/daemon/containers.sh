#!/bin/bash
# SPDX-License-Identifier: MIT
# The server in one container, front ends in another, as config/CONTAINERS.md says, without a container engine: each
# has its own network, processes, mounts, host name and IPC (unshare), a root that cannot be written, a user that is
# not root and has no capability. A bridge joins them, which looks at IGMP as those of Docker and Podman do.
#
# containers.sh BIN: the folder of the programs
set -u

# --- inside a container: containers.sh --inside ADDRESS BOX COMMAND... ---

URL='udpm://239.255.76.67:7667?ttl=1'

if [ "$1" = --inside ]; then
    address=$2 box=$3
    shift 3
    for _ in $(seq 600); do # the other end makes eth0, a network cable of ours
        ip link show eth0 >/dev/null 2>&1 && break
        sleep 0.1
    done
    # As an engine does it: an address, a default route, and no route for multicast alone.
    ip link set lo up && ip addr add "$address/24" dev eth0 && ip link set eth0 up &&
        ip route add default via 172.30.0.1 &&
        mount -t proc proc /proc && mount -t tmpfs -o mode=1777 tmpfs /dev/shm &&
        mount -t tmpfs -o mode=1777 tmpfs "$box/tmp" && mount -o remount,bind,ro / || exit 1
    cd "$box/tmp" || exit 1
    if [ -n "${CONTAINER_LIMITS:-}" ]; then ulimit -r 60 && ulimit -l unlimited || exit 1; fi
    exec env TMPDIR="$box/tmp" HOME="$box/tmp" LCM_DEFAULT_URL="${CONTAINER_URL:-$URL}" \
        setpriv --reuid 65534 --regid 65534 --clear-groups --no-new-privs --bounding-set=-all --inh-caps=-all \
        bash -c '
            grep -q "^CapEff:.*0000000000000000" /proc/self/status || { echo "has capabilities"; exit 1; }
            ! touch "$0/file" 2>/dev/null || { echo "the root can be written"; exit 1; }
            exec "$@"' "$box" "$@"
fi

# --- outside: the host with the bridge ---

if [ "$1" != --host ]; then
    [ "$(id -u)" = 0 ] && unshare --net --mount --pid --fork true 2>/dev/null ||
        { echo "skipped: namespaces need root here (unshare)"; exit 77; }
    exec unshare --net --mount --pid --fork --kill-child --mount-proc bash "$0" --host "$1"
fi
programs=$2
box=$(mktemp -d)
trap 'rm -rf "$box"' EXIT
fail() {
    echo "FAILED: $*"
    for log in "$box"/*.log; do echo "--- $(basename "$log")"; tail -n 12 "$log"; done
    exit 1
}

# What the "image" has: any user may read it, wherever the build is.
chmod 755 "$box"
mkdir "$box/tmp" "$box/page"
cp "$programs"/pliant{d,-probe,-monitor,-web} "$box/" || exit 1
echo '<p>the page</p>' >"$box/page/index.html"
cat >"$box/scene.cfg" <<'SCENE'
name = "container";  rate_hz = 500.0;  remote = true;
publish = { status_hz = 10.0;  contact_hz = 100.0;  positions = "packets"; };
bodies = ( { name = "ball";  model = "surface";  shape = {};
             mesh = { generator = "ico_sphere";  nodes = 642;  radius = 0.05; };
             fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.02]); } ); } );
tools = ( { id = 1;  kind = "probe";
            capsules = ( { from = [0.0, 0.0, 0.0];  to = [0.0, 0.0, 0.1];  radius = 0.005; } ); } );
SCENE
chmod -R a+rX "$box"

if ! ip link add br0 type bridge mcast_snooping 1 2>"$box/bridge.log"; then
    echo "skipped: no bridge on this kernel: $(cat "$box/bridge.log")"
    exit 77
fi
rm -f "$box/bridge.log"
ip link set lo up && ip addr add 172.30.0.1/24 dev br0 && ip link set br0 up || fail "no bridge"

# start NAME NUMBER COMMAND...: a container 172.30.0.NUMBER, whose output goes to NAME.log and whose first process,
# as the host sees it, is in $first
start() {
    local name=$1 number=$2
    shift 2
    unshare --net --mount --pid --ipc --uts --fork --kill-child bash "$0" --inside "172.30.0.$number" "$box" "$@" \
        >"$box/$name.log" 2>&1 &
    first=$!
    until [ "$(readlink /proc/$first/ns/net)" != "$(readlink /proc/self/ns/net)" ]; do
        kill -0 $first 2>/dev/null || fail "$name ended at once"
        sleep 0.02
    done
    ip link add "to$number" type veth peer name eth0 netns $first && ip link set "to$number" master br0 up ||
        fail "no network for $name"
}

# until_true SECONDS WHAT COMMAND...: a bound that only a failure reaches
until_true() {
    local tries=$(($1 * 10)) what=$2
    shift 2
    until "$@" >/dev/null 2>&1; do
        tries=$((tries - 1))
        [ $tries -gt 0 ] || fail "$what"
        sleep 0.1
    done
}
lines() { grep -c running "$box/monitor.log"; }
more_than() { [ "$(lines)" -gt "$1" ]; }
joined() { bridge mdb show | grep "port to$1 " | grep -q '239.255.76.67'; }

# --- the server in one, a monitor in another ---

start server 2 "$box/pliantd" "$box/scene.cfg"
server=$first
start monitor 3 "$box/pliant-monitor"
until_true 60 "the monitor heard nothing across the bridge" more_than 3
# Both have told the bridge which group they want.
until_true 30 "the server's membership is unknown to the bridge" joined 2
until_true 30 "the monitor's membership is unknown to the bridge" joined 3
grep -q 'not real-time' "$box/server.log" || fail "the server did not say which right is missing"

# --- a front end acts: remote = true, ttl = 1 ---

start probe 4 "$box/pliant-probe" --auto --depth 0.005 --hold 0.2
probe=$first
wait $probe || fail "the probe ended with $?"
grep -q '^touched after' "$box/probe.log" && grep -q 'force max 0\.0*[1-9]' "$box/probe.log" ||
    fail "the probe felt nothing"

# --- the page: TCP through the bridge, with its token ---

start web 5 "$box/pliant-web" --listen 172.30.0.5:8080 --page "$box/page"
get() { # PATH COOKIE
    exec 3<>/dev/tcp/172.30.0.5/8080 || return 1
    printf 'GET %s HTTP/1.1\r\nHost: 172.30.0.5:8080\r\nConnection: close\r\n%s\r\n' "$1" "${2:+Cookie: $2
}" >&3
    timeout 10 cat <&3
    exec 3>&-
}
until_true 30 "pliant-web did not start" grep -q 'token=' "$box/web.log"
token=$(sed -n 's/.*token=\([A-Za-z0-9_-]*\).*/\1/p' "$box/web.log" | head -n 1)
get / | grep -q '^HTTP/1.1 403' || fail "the page opened without its token"
get "/?token=$token" | grep -q '^HTTP/1.1 303' || fail "the page did not take its token"

# --- the trap: something on the network asks who listens, and forgets who does not answer ---

# Memberships now last 3 s and are asked for every second (in hundredths). The querier comes last: in one command it would
# ask before the others hold, and then not for half a minute.
ip link set br0 type bridge mcast_query_interval 100 mcast_query_response_interval 50 \
    mcast_membership_interval 300 mcast_startup_query_interval 100 &&
    ip link set br0 type bridge mcast_querier 1 || fail "no querier"
sleep 4 # longer than a membership lasts: those who did not answer would be forgotten
before=$(lines)
until_true 30 "nothing came once the bridge asked who listens" more_than $((before + 5))
joined 2 && joined 3 || fail "a membership was forgotten: $(bridge -s mdb show)"

# --- an engine stops a container: its first process is the server, and ends in order ---

kill -TERM "$(pgrep -P $server)" || fail "no server to stop"
until_true 30 "the server did not end in order" grep -q '^state: ' "$box/server.log"

# --- a pod: two containers with one network are one host, so messages need not leave it ---

# With --ulimit rtprio=60 --ulimit memlock=-1 the step thread is real-time, without any capability. (Not every host lets
# root raise its limits.)
export CONTAINER_URL='udpm://239.255.76.67:7667?ttl=0' CONTAINER_LIMITS=''
if (ulimit -r 60 && ulimit -l unlimited &&
    setpriv --reuid 65534 --regid 65534 --clear-groups chrt -f 1 true) 2>/dev/null; then
    CONTAINER_LIMITS=yes
else
    echo "limits of real time: not permitted here, not tested"
fi
start pod 6 "$box/pliantd" --prefix POD "$box/scene.cfg"
in_pod() {
    LCM_DEFAULT_URL=$CONTAINER_URL nsenter --net=/proc/$first/ns/net \
        setpriv --reuid 65534 --regid 65534 --clear-groups --bounding-set=-all \
        timeout 20 "$box/pliant-monitor" --prefix POD --once >"$box/inside.log" 2>&1
}
until_true 60 "nothing heard inside the pod" in_pod
grep -q '^container  running' "$box/inside.log" || fail "the pod's server does not run"
[ -n "$CONTAINER_LIMITS" ] && grep -q 'not real-time' "$box/pod.log" && fail "the limits do not make it real-time"
# From outside of it nothing is heard.
LCM_DEFAULT_URL=$URL timeout 20 "$box/pliant-monitor" --prefix POD --once >"$box/outside.log" 2>&1 &&
    fail "ttl=0 left the pod"
echo "server, front ends and page in containers: ok"
