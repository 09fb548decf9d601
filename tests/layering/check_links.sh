#!/bin/sh
# SPDX-License-Identifier: MIT
# What our documents and comments refer to is there: check_links.sh TOP [links]. With `links`, below TOP is what
# was installed, and only the first of these holds:
# - Every link of a README leads to a file, and to a heading that it has. Those of config/package/ lead to what is
#   installed: package_installed looks at them.
# - A link whose text is a function leads to the file that defines it, as in [`sim_step`](sim/step.c).
# - Every document that a comment names is there, beside the comment's file or from the top of the sources; and so
#   is every heading in it that the comment quotes, as in: server/README.md, "Threads and modules".
cd "$1" || exit 1
failed=0 functions=0
here=$(pwd)
# The anchor that a heading gets: lower case, only letters, digits, - and _, blanks as -.
has_heading() {
    sed -n 's/^##* //p' "$1" | tr 'A-Z ' 'a-z-' | tr -cd 'a-z0-9_\n-' | grep -qx -- "$2"
}
files=$(find . -name '*.md' -not -path './build/*' -not -path '*/node_modules/*' -not -path './study-*' \
    -not -path './config/package/*')
[ -n "$files" ] || { echo "no README found"; exit 1; }
for file in $files; do
    for link in $(grep -o ']([^) ]*)' "$file" | sed 's/^](//; s/)$//'); do
        case $link in *://*) continue ;; esac
        path=${link%%#*} target=$file
        [ -z "$path" ] || target=$(dirname "$file")/$path
        if [ ! -e "$target" ]; then
            echo "$file: no file '$path'"
            failed=1
        elif [ "$link" != "$path" ] && ! has_heading "$target" "${link#*#}"; then
            echo "$file: '$path' has no heading '${link#*#}'"
            failed=1
        fi
    done
    for link in $(grep -o '\[`[a-z_0-9]*`]([^) ]*\.c)' "$file"); do
        name=$(echo "$link" | sed 's/^\[`//; s/`.*//') target=$(dirname "$file")/$(echo "$link" | sed 's/.*(//; s/)$//')
        functions=$((functions + 1))
        if [ -f "$target" ] && ! grep -q "^[A-Za-z].*\<$name[()]" "$target"; then
            echo "$file: '$target' does not define $name"
            failed=1
        fi
    done
done
[ "${2-}" != links ] || exit $failed
[ "$functions" -ge 20 ] || { echo "hardly any function was seen in the documents: $functions"; failed=1; }

# The citations of the comments below the current folder: file, document and heading (or nothing), by tabs.
list_citations() {
    find . \( -path ./build -o -path ./.git -o -name node_modules \) -prune -o -type f \( -name '*.[ch]' -o -name '*.cpp' \
        -o -name '*.js' -o -name '*.mjs' -o -name '*.lcm' -o -name '*.sh' -o -name '*.py' -o -name '*.awk' -o -name '*.cfg' \
        -o -name '*.cmake' -o -name CMakeLists.txt -o -path ./dev -o -path ./.ci/run \) -print0 | xargs -0 awk '
        # Lines of one comment are read as one text, for a heading may go on in the next line.
        function flush(    rest, path) {
            rest = text
            text = ""
            while (match(rest, /[A-Za-z0-9_.\/-]*[A-Za-z0-9_]\.md/)) {
                path = substr(rest, RSTART, RLENGTH)
                rest = substr(rest, RSTART + RLENGTH)
                if (rest ~ /^[A-Za-z0-9_]/)
                    continue
                if (rest !~ /^, "/)
                    print name "\t" path "\t"
                while (match(rest, /^(,| and) "[^"]*"/)) {
                    quoted = substr(rest, RSTART, RLENGTH)
                    sub(/^[^"]*"/, "", quoted)
                    sub(/"$/, "", quoted)
                    print name "\t" path "\t" quoted
                    rest = substr(rest, RSTART + RLENGTH)
                }
            }
        }
        FNR == 1 { flush(); name = FILENAME; slashes = name ~ /\.(c|h|cpp|js|mjs|lcm)$/ }
        slashes && match($0, /^[ \t]*\/?\*+ |(^|[ \t])\/\/ ?/) ||
        !slashes && match($0, /(^|[ \t])#+ /) { text = text " " substr($0, RSTART + RLENGTH); next }
        { flush() }
        END { flush() }'
}
has_title() {
    title=$2 awk 'sub(/^#+ /, "") && $0 == ENVIRON["title"] { found = 1 } END { exit !found }' "$1"
}
# Prints what is wrong with the citations below the current folder, and then how many there are.
check_citations() {
    list_citations | {
        count=0
        while IFS='	' read -r file document title; do
            count=$((count + 1))
            target=$(dirname "$file")/$document
            [ -f "$target" ] || target=$document
            if [ ! -f "$target" ]; then
                echo "$file: no document '$document'"
            elif [ -n "$title" ] && ! has_title "$target" "$title"; then
                echo "$file: $document has no heading '$title'"
            fi
        done
        echo "$count citations"
    }
}
report=$(check_citations)
echo "$report" | sed '$d'
[ "$(echo "$report" | wc -l)" -eq 1 ] || failed=1
[ "$(echo "$report" | sed -n '$s/ .*//p')" -ge 20 ] || { echo "hardly any citation was seen: $report"; failed=1; }

# Of this sample two of five are wrong.
sample=$(mktemp -d) || exit 1
trap 'rm -r "$sample"' EXIT
mkdir "$sample/in"
printf '# A title\n\n## Another one\n' >"$sample/in/README.md"
printf '%s\n' '// Cites README.md, "Another' '// one" and "No such", and in/README.md, "A title".' 'int x; // none.md' \
    'const char *text = "not.md";' '/** in/README.md */' >"$sample/in/a.c"
cd "$sample" || exit 1
expected="./in/a.c: README.md has no heading 'No such'
./in/a.c: no document 'none.md'
5 citations"
[ "$(check_citations)" = "$expected" ] || { echo "wrong citations are not found:"; check_citations; failed=1; }
cd "$here" || exit 1
exit $failed
