#!/bin/sh
# Every link of our README files leads to a file that is there, and to a heading that it has:
# check_links.sh TOP
cd "$1" || exit 1
failed=0
# The anchor that a heading gets: lower case, only letters, digits, - and _, blanks as -.
has_heading() {
    sed -n 's/^##* //p' "$1" | tr 'A-Z ' 'a-z-' | tr -cd 'a-z0-9_\n-' | grep -qx -- "$2"
}
files=$(find . -name '*.md' -not -path './build/*' -not -path './*/node_modules/*' -not -path './study-*')
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
done
exit $failed
