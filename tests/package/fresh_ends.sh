#!/bin/bash
# SPDX-License-Identifier: MIT
# However `./dev fresh` ends - done, failed, interrupted - nothing of it stays: no folder, no mount, no process;
# and it says why where it may not begin. Here debootstrap only copies what a shell needs, and the checkout is
# one of ours, whose ./dev does what it is told.
#
# fresh_ends.sh FRESH_SH
set -euo pipefail
fresh=$(realpath "$1")
[ "$(id -u)" -eq 0 ] && unshare --mount --pid --fork true 2>/dev/null ||
    { echo "skipped: needs root, and mounts (unshare --mount --pid)"; exit 77; }

work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
die() { echo "fresh_ends: $*" >&2; cat "$work/log" >&2 || true; exit 1; }

mkdir "$work/bin" "$work/tmp" "$work/checkout"
cat >"$work/bin/debootstrap" <<'END'
#!/bin/bash
root=${*: -2:1}
echo "$*" >>"${0%/*}/asked"
mkdir -p "$root"/{etc/apt/apt.conf.d,etc/dpkg/dpkg.cfg.d,proc,sys,dev/pts,dev/shm,usr/bin,lib}
cd "$root" && ln -s usr/bin bin
for program in bash env sleep mkdir; do
    cp "/usr/bin/$program" usr/bin/
    ldd "/usr/bin/$program" | grep -o '/[^ ]*' | xargs -I{} cp --parents -L {} . 
done
END
chmod +x "$work/bin/debootstrap"
cat >"$work/checkout/dev" <<'END'
#!/bin/bash
case $1 in
demo) mkdir demo-out && echo picture >demo-out/a.png ;;
hang) sleep 300 & : >hangs; sleep 300 ;;
*) exit 1 ;;
esac
END
chmod +x "$work/checkout/dev"
git -C "$work/checkout" init -q
git -C "$work/checkout" add -A
git -C "$work/checkout" -c user.name=nobody -c user.email=nobody@localhost commit -qm one
export TMPDIR=$work/tmp PATH=$work/bin:$PATH

nothing_stays() { # CASE
    [ -z "$(ls -A "$work/tmp")" ] || die "$1: a folder stays: $(ls "$work/tmp")"
    ! grep -q "$work" /proc/mounts || die "$1: a mount stays"
    local root
    for root in /proc/[0-9]*/root; do
        [[ $(readlink "$root" 2>/dev/null) != "$work"* ]] || die "$1: a process stays: $root"
    done
}

bash "$fresh" "$work/checkout" demo >"$work/log" 2>&1 || die "what should pass fails"
[ -f "$work/checkout/build/fresh-demo-out/a.png" ] || die "the demo's pictures are lost"
nothing_stays passed

bash "$fresh" "$work/checkout" --suite sid demo >"$work/log" 2>&1 || die "with another suite it fails"
tail -n 1 "$work/bin/asked" | grep -q -- ' sid ' || die "another suite was not asked for: $(cat "$work/bin/asked")"
nothing_stays "another suite"
for wrong in "--suite" "--arch pdp11 demo" "--mirror here demo"; do
    ! bash "$fresh" "$work/checkout" $wrong >"$work/log" 2>&1 || die "takes $wrong"
    grep -q 'dev fresh: ' "$work/log" || die "$wrong is refused without a word"
done

! bash "$fresh" "$work/checkout" fail >"$work/log" 2>&1 || die "what should fail passes"
grep -q 'failed on a bare Debian' "$work/log" || die "a failure is not told of"
nothing_stays failed

# interrupted SIGNAL STATUS: while a command runs in the root
interrupted() {
    local status=0 process
    # Background processes of a script ignore SIGINT, unless they are told not to.
    env --default-signal bash "$fresh" "$work/checkout" hang >"$work/log" 2>&1 &
    process=$!
    for _ in $(seq 300); do
        ! compgen -G "$work/tmp/*/root/pliant/hangs" >/dev/null || break
        sleep 0.1
    done
    compgen -G "$work/tmp/*/root/pliant/hangs" >/dev/null || die "it did not begin within 30 s"
    kill "-$1" $process
    wait $process || status=$?
    [ $status -eq "$2" ] || die "$1: ended with $status, not $2"
    nothing_stays "$1"
}
interrupted INT 130
interrupted TERM 143

! setpriv --reuid 65534 --clear-groups bash "$fresh" "$work/checkout" >"$work/log" 2>&1 || die "runs without root"
grep -q 'needs root' "$work/log" || die "without root: it does not say so"
