#!/bin/sh
# SPDX-License-Identifier: MIT
# Makes the installed documents stand on what is installed: settle_documents.sh DOCUMENTS SHARE PREFIX.
# - Links to scenes and message types go to their folder, those to files that only the source has become text.
# - Commands name programs as they are on the path, and scenes where they are (below PREFIX: a package is made
#   elsewhere than where it will be).
# What it has settled it leaves as it is.
set -eu
documents=$1 share=$2 prefix=$3
list=$(mktemp) out=$(mktemp)
trap 'rm -f "$list" "$out"' EXIT

# settle ROOT OTHER: the documents below a folder, which has links to the other one.
settle() {
    over=$(realpath --relative-to="$1" "$2")
    (cd "$1" && find . -mindepth 1 | sed 's,^\./,in ,') >"$list"
    (cd "$2" && find . -mindepth 1 -not -name '*.md' | sed 's,^\./,beside ,') >>"$list"
    (cd "$1" && find . -name '*.md' | sed 's,^\./,,') | while read -r file; do
        awk -v file="$file" -v over="$over" -v scenes="$prefix/share/pliant/" -v list="$list" '
        # Resolves a link of a file; that of the source stands a folder deeper than there.
        function resolve(link,    part, kept, n, i, count, path) {
            path = file
            sub(/^source\//, "", path)
            sub(/[^\/]*$/, "", path)
            n = split(path link, part, "/")
            count = 0
            for (i = 1; i <= n; i++)
                if (part[i] == "..")
                    count--
                else if (part[i] != "." && part[i] != "")
                    kept[++count] = part[i]
            path = ""
            for (i = 1; i <= count; i++)
                path = path (i > 1 ? "/" : "") kept[i]
            # Its front page is not the one of the packages.
            return path == "README.md" && file != path ? "source/README.md" : path
        }
        # Returns the link that leads there from where the file is, or "".
        function lead(link,    up, from, path) {
            path = resolve(link)
            if (path in inside && (file path) !~ /^source\/|source\/README/)
                return link
            from = file
            while (sub(/^[^\/]*\//, "", from))
                up = up "../"
            return path in inside ? up path : path in beside ? up over "/" path : ""
        }
        # Returns where the bracket opens that closes at the end of a text.
        function opening(text,    i, depth, sign) {
            for (i = length(text); i > 0; i--) {
                sign = substr(text, i, 1)
                depth += sign == "]" ? 1 : sign == "[" ? -1 : 0
                if (depth == 0)
                    return i
            }
            return 0
        }
        BEGIN {
            while ((getline entry <list) > 0)
                if (entry ~ /^in /)
                    inside[substr(entry, 4)]
                else
                    beside[substr(entry, 8)]
            RS = "\001"
        }
        {
            rest = $0
            text = ""
            while (match(rest, /\]\([^) ]*\)/)) {
                text = text substr(rest, 1, RSTART)
                link = substr(rest, RSTART + 2, RLENGTH - 3)
                rest = substr(rest, RSTART + RLENGTH)
                anchor = match(link, /#/) ? substr(link, RSTART) : ""
                path = substr(link, 1, length(link) - length(anchor))
                sub(/\/$/, "", path)
                to = path == "" || link ~ /:\/\// ? link : lead(path)
                if (to != "" && to != link)
                    to = to anchor
                at = to == "" ? opening(text) : 0
                if (at > 0) # the text of a link, and of a picture, that leads nowhere
                    text = substr(text, 1, at - 1 - (substr(text, at - 1, 1) == "!")) \
                        substr(text, at + 1, length(text) - at - 1)
                else
                    text = text "(" (to == "" ? link : to) ")"
            }
            count = split(text rest, line, "\n")
            for (i = 1; i <= count; i++) {
                block = line[i] ~ /^```/ ? !block : block
                gsub(/build\/release\/bin\//, "", line[i])
                if (block)
                    gsub(/ config\/[a-z-]*\.cfg/, " \002&", line[i])
                gsub(/\002 |\/usr\/share\/pliant\//, scenes, line[i])
                printf "%s%s", line[i], i < count ? "\n" : ""
            }
        }' "$1/$file" >"$out"
        # With the same time, so that two packages of one source are the same.
        cmp -s "$out" "$1/$file" || { touch -r "$1/$file" "$out" && cat "$out" >"$1/$file" && touch -r "$out" "$1/$file"; }
    done
}
settle "$documents" "$share"
settle "$share" "$documents"
