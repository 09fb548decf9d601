#!/bin/sh
# SPDX-License-Identifier: MIT
# What `cmake --install` has put below a prefix works from there: scenes, service and message types.
#
# installed.sh BUILD SANITIZE: a build folder, and what it is sanitized by ("": nothing)
set -eu
build=$1 sanitize=${2-}
links_check=$(realpath "$0" | xargs dirname)/../layering/check_links.sh
work=$(mktemp -d "${TMPDIR:-/tmp}/pliant-installed-XXXXXX")
trap 'rm -rf "$work"' EXIT
prefix=$work/pliant

die() {
    echo "installed: $*" >&2
    exit 1
}

install_it() {
    cmake --install "$build" --prefix "$prefix" >"$work/log" 2>&1 || {
        cat "$work/log" >&2
        die "cmake --install failed"
    }
}

install_it
cd / # none of it may lean on where it was built

# --- scenes ---

checked=0
for scene in "$prefix"/share/pliant/config/*.cfg "$prefix/etc/pliant/demo.cfg"; do
    # table.cfg and others have bodies of both kinds, one of which may not be built in.
    if ! "$prefix/bin/pliantd" --check "$scene" >"$work/out" 2>&1; then
        grep -q 'built without' "$work/out" || { cat "$work/out" >&2; die "$scene is refused"; }
        continue
    fi
    checked=$((checked + 1))
done
[ $checked -ge 5 ] || die "only $checked scenes are there"

# A scene that was changed stays when another version is installed.
echo '# mine' >"$prefix/etc/pliant/demo.cfg"
install_it
[ "$(cat "$prefix/etc/pliant/demo.cfg")" = '# mine' ] || die "demo.cfg was overwritten"

# --- service ---

unit=$prefix/lib/systemd/system/pliantd@.service
grep -q "^ExecStart=$prefix/bin/pliantd .*$prefix/etc/pliant/%i.cfg\$" "$unit" ||
    die "the unit does not run what was installed: $(grep ExecStart "$unit")"
grep -q '@[A-Z]*@' "$unit" && die "the unit has names that were not filled in"
if command -v systemd-analyze >/dev/null; then
    cp "$unit" "$work/pliantd@demo.service"
    systemd-analyze verify --man=no "$work/pliantd@demo.service" >"$work/verify" 2>&1 ||
        { cat "$work/verify" >&2; die "systemd-analyze verify refuses the unit"; }
    # Of other units of the machine it may speak, too.
    ! grep 'pliantd@demo' "$work/verify" || die "systemd-analyze verify warns of the unit"
else
    echo "installed: no systemd-analyze here: the unit was not verified"
fi

# --- documents ---

# Each link of each document leads to what is installed, commands name programs on the path and scenes that are
# there, and the front page does not speak of the source's commands but in the line that says so.
doc=$(dirname "$(find "$prefix" -path '*/doc/pliant/README.md')")
links=$(find "$prefix" -name '*.md' -exec grep -o ']([^) ]*)' {} + | wc -l)
[ "$links" -ge 200 ] || die "the installed documents have $links links: the test does not see them"
sh "$links_check" "$prefix" links >"$work/dead" || { cat "$work/dead" >&2; die "documents lead nowhere"; }
grep -rn 'build/release/bin' "$prefix" --include='*.md' && die "commands are not on the path"
scenes=0
for scene in $(grep -rhoE '(pliantd|--explain) (.* )?/[^ ]*/config/[a-z-]*\.cfg' "$doc" | sed 's/.* //' | sort -u); do
    [ -e "$scene" ] || die "a command names $scene, which is not there"
    scenes=$((scenes + 1))
done
[ $scenes -ge 5 ] || die "only $scenes scenes are named by commands"
grep -v 'exist only there' "$doc/README.md" | grep -n '\./dev\|build/' &&
    die "the installed README.md names commands of the source"

# --- hardening ---

# hardened PROGRAM: loads anywhere, its relocations are read-only, it has stack protectors and checked calls.
hardened() {
    readelf -h "$1" | grep -q 'Type: *DYN' || die "$1 is not position independent"
    readelf -d "$1" | grep -q 'BIND_NOW\|FLAGS_1.*NOW' || die "$1 binds lazily"
    readelf -l "$1" | grep -q GNU_RELRO || die "$1 has no read-only relocations"
    readelf -Ws --dyn-syms "$1" >"$work/symbols"
    grep -q '__stack_chk_fail' "$work/symbols" || die "$1 has no stack protector"
    grep -q '__[a-z]*printf_chk' "$work/symbols" || die "$1 was built without _FORTIFY_SOURCE"
}

if [ -z "$sanitize" ] && grep -q '^PLIANT_HARDEN:BOOL=ON' "$build/CMakeCache.txt"; then
    for program in "$prefix"/bin/pliant* $(find "$prefix" -name libpliant-client.so); do
        hardened "$program"
    done
fi

# --- message types ---

pc=$(find "$prefix" -name pliant-lcmtypes.pc)
[ -n "$pc" ] || die "no pliant-lcmtypes.pc"
if command -v pkg-config >/dev/null && [ -z "$sanitize" ]; then
    cat >"$work/pose.c" <<'END'
#include <pliant_tool_pose_t.h>
#include <stdio.h>
int main(void)
{
    pliant_tool_pose_t pose = {.tool = 1, .orientation = {1.0}};
    char data[1024];
    printf("%d\n", pliant_tool_pose_t_encode(data, 0, sizeof data, &pose));
    return 0;
}
END
    # Its package of LCM names no glib, which pkg-config would ask for.
    # shellcheck disable=SC2046
    cc -o "$work/pose" "$work/pose.c" \
        $(PKG_CONFIG_PATH=$(dirname "$pc") pkg-config --cflags --libs pliant-lcmtypes)
    # 8 bytes of fingerprint; utime, three numbers, 13 reals and the grip, two flags.
    [ "$("$work/pose")" -eq $((8 + 8 + 3 * 4 + 13 * 8 + 8 + 2)) ] || die "the types do not encode"
else
    echo "installed: nothing was linked with the message types"
fi
