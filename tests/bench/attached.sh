#!/bin/bash
# SPDX-License-Identifier: MIT
# What it costs the step thread that others listen: percentiles of the daemon's step and wake-up times
# with monitor, recorders, logger and web server attached, beside those with nobody there. Runs
# alternate (none A B C none A B C ...), so that the machine's moods meet all of them; what is printed
# is the median of the runs. Each run presses the first body once.
#   attached.sh BIN [REPEATS [SECONDS [SCENE]]]
# Programs that are not there are left out, and named.
set -u
bin=$(realpath "${1:?usage: attached.sh BIN [REPEATS [SECONDS [SCENE]]]}")
repeats=${2:-5}
seconds=${3:-8}
root=$(dirname "$0")/../..
scene=$(realpath "${4:-$root/config/stomach.cfg}")

if [ -z "${PLIANT_ATTACHED_INSIDE:-}" ]; then
    export PLIANT_ATTACHED_INSIDE=1
    exec "$root/tests/daemon/in_namespace.sh" bash "$0" "$bin" "$repeats" "$seconds" "$scene"
fi

out=$(mktemp -d "${TMPDIR:-/tmp}/pliant-attached-XXXXXX")
attached=()
end_attached() {
    local pid
    for pid in "${attached[@]:+${attached[@]}}"; do
        kill -INT "$pid" 2>/dev/null
        wait "$pid" 2>/dev/null
    done
    attached=()
}
trap 'end_attached; rm -rf "$out"' EXIT

cases=(none)
left_out=()
offer() { # CASE PROGRAM
    if command -v "$2" >/dev/null; then cases+=("$1"); else left_out+=("$1 (no $(basename "$2"))"); fi
}
offer monitor "$bin/pliant-monitor"
# Whether this daemon can record at all.
if "$bin/pliantd" --help | grep -q -- --record; then cases+=(--record); else left_out+=(--record); fi
offer pliant-record "$bin/pliant-record"
offer lcm-logger lcm-logger
offer pliant-web "$bin/pliant-web"
cases+=(all)

body=$("$bin/pliantd" --check "$scene" 2>/dev/null | awk '$1 == "body" { gsub(/[:,]/, "", $2); print $2; exit }')

attach() { # PROGRAM
    case $1 in
    monitor)
        "$bin/pliant-monitor" --nodes "$body" --write "$out/curve.tsv" >"$out/monitor.log" 2>&1 &
        attached+=($!) ;;
    pliant-record)
        "$bin/pliant-record" --output "$out/listened.h5" >"$out/record.log" 2>&1 &
        attached+=($!) ;;
    lcm-logger)
        lcm-logger -q -f "$out/log.lcm" >"$out/logger.log" 2>&1 &
        attached+=($!) ;;
    pliant-web)
        "$bin/pliant-web" --port 8080 >"$out/web.log" 2>&1 &
        attached+=($!)
        # A page without a browser; one that draws is another machine's work.
        if command -v python3 >/dev/null; then
            timeout "$((seconds + 5))" python3 "$root/tests/bench/page.py" 8080 "$seconds" >"$out/page.log" 2>&1 &
            attached+=($!)
        fi ;;
    esac
}

run() { # CASE
    local options=() one
    rm -f "$out"/*.h5* "$out"/log.lcm*
    case $1 in
    none) ;;
    --record) options=(--record "$out/recording.h5") ;;
    all)
        for one in "${cases[@]}"; do
            case $one in none | all) ;; --record) options=(--record "$out/recording.h5") ;; *) attach "$one" ;; esac
        done ;;
    *) attach "$1" ;;
    esac
    sleep 0.5
    "$bin/pliantd" --duration "$seconds" ${options[@]:+"${options[@]}"} "$scene" >"$out/daemon.log" 2>"$out/daemon.err" &
    local daemon=$!
    sleep 1
    "$bin/pliant-probe" --auto --hold $((seconds > 5 ? seconds - 5 : 1)) >"$out/probe.log" 2>&1
    wait "$daemon" || { cat "$out/daemon.err" >&2; exit 1; }
    end_attached
    [ ! -s "$out/page.log" ] || cp "$out/page.log" "$out/page.last"
    # step p50 p99 p99.9 max, wake-up p50 p99 p99.9 max, late ticks
    awk -v name="$1" '
        /^step time:|^wake-up:/ { gsub(/[^0-9. ]/, " "); row = row "\t" $2 "\t" $4 "\t" $6 "\t" $7 }
        /^late ticks:/ { late = $3 }
        END { print name row "\t" late }' "$out/daemon.log"
}

for ((i = 0; i < repeats; i++)); do
    for one in "${cases[@]}"; do
        run "$one"
    done
done >"$out/rows.tsv"

echo "$(basename "$scene"), $repeats runs of $seconds s each, median of the runs; us"
[ ${#left_out[@]} -eq 0 ] || echo "left out: ${left_out[*]}"
[ ! -s "$out/page.last" ] || echo "the page got, in the last run: $(cat "$out/page.last")"
{
    printf 'attached\tstep p50\tp99\tp99.9\tmax\twake-up p50\tp99\tp99.9\tmax\tlate ticks\n'
    awk -F '\t' '
        function median(list, n, i, j, t) {
            for (i = 2; i <= n; i++) for (j = i; j > 1 && list[j] < list[j-1]; j--) { t = list[j]; list[j] = list[j-1]; list[j-1] = t }
            return n % 2 ? list[(n + 1) / 2] : (list[n / 2] + list[n / 2 + 1]) / 2
        }
        { if (!($1 in count)) order[++cases] = $1; k = ++count[$1]; for (c = 2; c <= NF; c++) value[$1, c, k] = $c + 0 }
        END {
            for (n = 1; n <= cases; n++) {
                line = order[n]
                for (c = 2; c <= 10; c++) {
                    delete list
                    for (k = 1; k <= count[order[n]]; k++) list[k] = value[order[n], c, k]
                    line = line "\t" median(list, count[order[n]])
                }
                print line
            }
        }' "$out/rows.tsv"
} | column -t -s $'\t'
