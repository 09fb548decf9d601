#!/bin/bash
# SPDX-License-Identifier: MIT
# Runs a command of ./dev on a bare Debian: in a root of its own that debootstrap makes, with nothing in it but
# a clean clone of what is committed. Root only.
#
# fresh.sh CHECKOUT [--suite NAME] [--arch NAME] COMMAND...    what `./dev fresh ...` calls
#
# All mounts are made in a mount namespace of its own: they end with it, however it ends, and were never seen
# outside. All processes run in a process namespace, which is killed as a whole.
set -euo pipefail

# Of Debian; inside, the process outside has set them.
RELEASE=${PLIANT_FRESH_SUITE:-bookworm}
ARCH=${PLIANT_FRESH_ARCH:-$(dpkg --print-architecture)}
NEEDED_KB=$((5 * 1024 * 1024)) # what ./dev deps and all builds take
MIRROR=http://deb.debian.org/debian

die() { printf 'dev fresh: %s\n' "$*" >&2; exit 1; }
say() { printf '\n== %s\n' "$*"; }

# A folder of its own where devices and programs work and enough is free.
make_folder() {
    local parent options free
    for parent in "${TMPDIR:-/tmp}" /var/tmp "$1"; do
        [ -w "$parent" ] || continue
        options=,$(findmnt -n -o OPTIONS -T "$parent"),
        free=$(df --output=avail -k "$parent" | tail -n 1)
        [[ $options == *,nodev,* || $options == *,noexec,* ]] || [ "$free" -lt $NEEDED_KB ] ||
            { mktemp -d "$parent/pliant-fresh-XXXXXX"; return; }
    done
    die "no folder with $((NEEDED_KB / 1024 / 1024)) GB free on a file system that permits devices and programs;
name one: TMPDIR=FOLDER ./dev fresh"
}

# --- as this machine reaches Debian and npm ---

# "SITE RELEASE COMPONENT" a line, of this machine's sources if they are Debian's.
debian_sources() {
    apt-get indextargets --format '$(SITE) $(RELEASE) $(COMPONENT) $(ORIGIN) $(CODENAME)' \
        'Created-By: Packages' 2>/dev/null | awk '$4 == "Debian"' | sort -u |
        awk -v release="$RELEASE" '$5 == release || index($5, release "-") == 1 { print $1, $2, $3; found = 1 }
            $5 !~ /-/ && $2 == $5 && !site { site = $1 } # where this machine gets another release
            END { if (!found && site) print site, release, "main" }'
}

take_apt_settings() { # ROOT
    local sources file
    sources=$(debian_sources)
    [ -n "$sources" ] || sources="$MIRROR $RELEASE main
$MIRROR $RELEASE-updates main
${MIRROR%/debian}/debian-security $RELEASE-security main"
    sed 's/^/deb /' <<<"$sources" >"$1/etc/apt/sources.list"
    # Proxies and the like, but no hooks: their programs are not there.
    apt-config dump | grep -E '^Acquire::(http|https|Check|ForceIP|Retries|Languages)' \
        >"$1/etc/apt/apt.conf.d/90host" || true
    echo force-unsafe-io >"$1/etc/dpkg/dpkg.cfg.d/unsafe-io" # nothing here outlives a crash
    for file in auth.conf auth.conf.d trusted.gpg trusted.gpg.d keyrings; do
        [ ! -e "/etc/apt/$file" ] || cp -rLf "/etc/apt/$file" "$1/etc/apt/"
    done
    for file in resolv.conf hosts; do
        cp -Lf "/etc/$file" "$1/etc/$file"
    done
    # Certificates of a proxy too: apt and npm read them before Debian's own are installed.
    mkdir -p "$1/etc/ssl/certs" "$1/usr/local/share/ca-certificates"
    [ ! -f /etc/ssl/certs/ca-certificates.crt ] ||
        cp -Lf /etc/ssl/certs/ca-certificates.crt "$1/etc/ssl/certs/"
    cp -rLf /usr/local/share/ca-certificates/. "$1/usr/local/share/ca-certificates/" 2>/dev/null || true
}

# What of this machine's environment and of npm's settings the network wants, as NAME=VALUE lines.
network_settings() {
    local name value
    env | grep -iE '^(http|https|ftp|all|no)_proxy=' || true
    [ ! -f /etc/ssl/certs/ca-certificates.crt ] ||
        echo NODE_EXTRA_CA_CERTS=/etc/ssl/certs/ca-certificates.crt
    command -v npm >/dev/null || return 0
    npm config get registry proxy https-proxy noproxy 2>/dev/null |
        while IFS== read -r name value; do
            case $value in '' | null | undefined) ;; *) echo "npm_config_${name//-/_}=$value" ;; esac
        done
}

# --- inside the namespaces ---

make_root() { # ROOT LOG
    local mirror proxy='' start=$SECONDS
    mirror=$(debian_sources | awk -v release="$RELEASE" '$2 == release { print $1; exit }')
    eval "$(apt-config shell proxy Acquire::http::Proxy)"
    [ -z "$proxy" ] || export http_proxy=${http_proxy:-$proxy}
    say "a bare Debian ($RELEASE, $ARCH) in $1"
    debootstrap --arch="$ARCH" --variant=minbase "$RELEASE" "$1" "${mirror:-$MIRROR}" >"$2" 2>&1 ||
        { tail -n 20 "$2" >&2; die "debootstrap failed (see above): is there a network, and may devices be made?"; }
    take_apt_settings "$1"
    echo "made in $((SECONDS - start)) s"
}

mount_system() { # ROOT
    mount -t proc proc "$1/proc" && mount -t sysfs -o ro sysfs "$1/sys" &&
        mount -t devpts -o newinstance,ptmxmode=0666 devpts "$1/dev/pts" &&
        mount -t tmpfs tmpfs "$1/dev/shm" || die "mounts are refused here (a container without privileges?)"
    # For the tests of links between hosts; debootstrap makes only the common devices.
    mkdir -p "$1/dev/net" && mknod "$1/dev/net/tun" c 10 200 2>/dev/null || true
}

# The programs and the page are there: the ordinary build only warns where a library of pliant-web, or the page,
# is missing.
check_build() { # CLONE
    local program
    [ -d "$1/build/release/bin" ] || return 0
    for program in pliantd pliant-prepare pliant-probe pliant-cut pliant-tie pliant-monitor pliant-record pliant-play \
        pliant-drake pliant-study pliant-fit pliant-touch pliant-web; do
        [ -x "$1/build/release/bin/$program" ] || die "$program was not built"
    done
    [ -f "$1/build/web/index.html" ] ||
        { tail -n 20 "$1/build/web.log" >&2 || true; die "the page was not built (see above)"; }
}

inside() { # CHECKOUT FOLDER COMMAND...
    local checkout=$1 folder=$2 root=$2/root settings
    shift 2
    make_root "$root" "$folder/debootstrap.log"
    mount_system "$root"
    git clone -q "$checkout" "$root/pliant" || die "cannot clone $checkout"
    [ "$(git -C "$root/pliant" rev-parse HEAD)" = "$(git -C "$checkout" rev-parse HEAD)" ] ||
        die "the clone has another commit than $checkout"
    mapfile -t settings < <(network_settings)
    say "./dev $* (commit $(git -C "$checkout" rev-parse --short HEAD))"
    # Background processes ignore Ctrl-C, and hand that down.
    chroot "$root" /usr/bin/env -i --default-signal "${settings[@]}" HOME=/root LANG=C.UTF-8 TERM="${TERM:-dumb}" \
        PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
        bash -c 'cd /pliant && exec ./dev "$@"' bash "$@" || die "./dev $* failed on a bare Debian"
    check_build "$root/pliant"
    if [ -d "$root/pliant/demo-out" ]; then
        mkdir -p "$checkout/build"
        rm -rf "$checkout/build/fresh-demo-out"
        cp -r "$root/pliant/demo-out" "$checkout/build/fresh-demo-out"
        say "what it left"
        ls "$checkout"/build/fresh-demo-out/*.png
    fi
}

# --- outside ---

# Of another architecture the kernel must know an emulator.
can_run() {
    local machine
    [ "$ARCH" != "$(dpkg --print-architecture)" ] || return 0
    case $ARCH in arm64) machine=aarch64 ;; *) machine=$ARCH ;; esac
    grep -qs '^enabled' "/proc/sys/fs/binfmt_misc/qemu-$machine"
}

folder='' namespace=''
clean_up() {
    trap '' INT TERM HUP
    [ -z "$namespace" ] || kill -KILL "$namespace" 2>/dev/null || true
    [ -z "$namespace" ] || wait "$namespace" 2>/dev/null || true
    [ -n "$folder" ] || return 0
    # The processes of the namespace are killed behind our back: some may still write.
    for _ in $(seq 50); do
        rm -rf --one-file-system "$folder" 2>/dev/null && return 0
        sleep 0.1
    done
    echo "dev fresh: could not remove $folder" >&2
}

outside() {
    local checkout=$1
    shift
    while [[ ${1-} == --* ]]; do
        [ $# -ge 2 ] || die "$1 needs a name"
        case $1 in
        --suite) RELEASE=$2 ;;
        --arch) ARCH=$2 ;;
        *) die "unknown option '$1' (--suite NAME, --arch NAME)" ;;
        esac
        shift 2
    done
    export PLIANT_FRESH_SUITE=$RELEASE PLIANT_FRESH_ARCH=$ARCH
    [ $# -gt 0 ] || set -- demo
    can_run || die "this machine runs no programs of $ARCH (Debian: qemu-user-static binfmt-support)"
    [ "$(id -u)" -eq 0 ] || die "needs root: debootstrap makes devices, chroot enters (sudo ./dev fresh)"
    command -v debootstrap >/dev/null || die "needs debootstrap (Debian has it in: debootstrap)"
    command -v git >/dev/null && git -C "$checkout" rev-parse -q --verify HEAD >/dev/null ||
        die "needs git, and a checkout: it runs what is committed"
    [ -z "$(git -C "$checkout" status --porcelain)" ] || echo "dev fresh: without what is not committed" >&2
    local private=(unshare --mount --pid --fork --mount-proc --kill-child)
    "${private[@]}" true 2>/dev/null || die "mounts are refused here (unshare --mount --pid; a container?)"
    trap clean_up EXIT
    trap 'exit 130' INT
    trap 'exit 143' TERM HUP
    folder=$(make_folder "$checkout/build")
    "${private[@]}" bash "$0" --inside "$checkout" "$folder" "$@" </dev/null &
    namespace=$!
    wait $namespace || exit 1
}

# On one line, which the shell has read as a whole: the file may change while this runs.
case ${1-} in --inside) inside "${@:2}" ;; *) outside "$@" ;; esac; exit
