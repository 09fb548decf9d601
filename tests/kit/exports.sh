#!/bin/sh
# SPDX-License-Identifier: MIT
# The libraries have the functions of the header, and nothing else, and need what a haptic client needs:
# exports.sh NM HEADER SHARED STATIC SONAME
set -eu
nm=$1 header=$2 shared=$3 static=$4 soname=$5
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
die() { echo "exports: $*"; exit 1; }

sed -n 's/^PLIANT_API .*[ *]\(pliant_[a-z_]*\)(.*/\1/p' "$header" | sort >"$work/declared"
[ "$(wc -l <"$work/declared")" -ge 20 ] || die "hardly any function was seen in $header"
# Each has a version, which programs that link it remember.
sed 's/$/@@PLIANT_0/' "$work/declared" >"$work/versioned"
"$nm" -D --defined-only "$shared" | awk '$2 != "A" { print $3 }' | sort >"$work/shared"
diff "$work/versioned" "$work/shared" || die "header (<) and shared library (>) differ"
"$nm" -g --defined-only "$static" | awk 'NF == 3 { print $3 }' | sort >"$work/static"
diff "$work/declared" "$work/static" || die "header (<) and static library (>) differ"
readelf -d "$shared" | grep -q "SONAME.*\[$soname\]" || die "the library is not $soname"

# LCM, the libraries that LCM needs, and C's.
readelf -d "$shared" | sed -n 's/.*(NEEDED).*\[\(.*\)\.so.*/\1/p' | sort >"$work/needed"
for library in $(cat "$work/needed"); do
    case $library in
    liblcm | libm | libc | libdl) ;;
    *) die "the library needs $library" ;;
    esac
done
grep -q liblcm "$work/needed" || die "the library does not need LCM: nothing was seen"
lcm=$(ldd "$shared" | awk '$1 ~ /^liblcm/ { print $3 }')
of_lcm=$(ldd "$lcm" | wc -l)
count=$(ldd "$shared" | wc -l)
[ "$count" -le $((of_lcm + 3)) ] || die "the library pulls $count libraries, LCM alone $of_lcm"
! ldd "$shared" | grep -i hdf5 || die "the library pulls HDF5"
echo "exports: $(wc -l <"$work/declared") functions; $count libraries, $of_lcm of them LCM's"
