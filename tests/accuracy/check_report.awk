# Compares tables of figures with those that a report has: awk -f check_report.awk REPORT... DATA...
# A table of DATA is found in the reports by its header: each of its columns must be there. All figures must
# be equal as they are printed: the same scene gives the same bits on every machine, so there is no
# tolerance but the rounding to the digits shown. Columns that say how long something took are left out.
function timed(title) { return title ~ /\[[mu]s\]|^[mun]s |saved|times faster|per element/ }
# Columns by name; the second of a name as NAME#2.
function name_columns(cell, n,    c, count) {
    for (c = 1; c <= n; c++)
        if (count[cell[c]]++) cell[c] = cell[c] "#" count[cell[c]]
}
function complain(what) { print "check_report: " what > "/dev/stderr"; failed = 1 }
function split_row(line, cell,    n, i) {
    sub(/^\| /, "", line); sub(/ \|$/, "", line)
    n = split(line, cell, / \| /)
    return n
}
# The next table with the columns of the header, preferring one that has no others; 0: none. Tables with the
# same columns are taken in the order of the files named.
function find(titles, n,    t, c, all, best) {
    best = 0
    for (t = 1; t <= tables; t++) {
        all = !(t in used)
        for (c = 1; c <= n && all; c++) all = (t, titles[c]) in column
        if (all && (best == 0 || columns[t] < columns[best])) best = t
    }
    return best
}
FILENAME ~ /\.md$/ {
    if ($0 !~ /^\|/) { inside = 0; next }
    n = split_row($0, cell)
    if (!inside) {
        inside = 1; tables++; columns[tables] = n; rows[tables] = -1
        name_columns(cell, n)
        for (c = 1; c <= n; c++) column[tables, cell[c]] = c
    } else if (++rows[tables] > 0)
        for (c = 1; c <= n; c++) value[tables, rows[tables], c] = cell[c]
    next
}
FNR == 1 {
    n = split($0, title, "\t")
    name_columns(title, n)
    at = find(title, n)
    if (at == 0) { complain(FILENAME ": no report has a table with these columns: " $0); next }
    compared++
    used[at] = FILENAME; row_count[at] = 0
    next
}
at != 0 {
    m = split($0, cell, "\t")
    row = ++row_count[at]
    for (c = 1; c <= n; c++) {
        if (timed(title[c])) continue
        stands = value[at, row, column[at, title[c]]]
        sub(/^ */, "", stands); sub(/ *$/, "", stands)
        figures++
        if (stands != (c <= m ? cell[c] : ""))
            complain(FILENAME ":" FNR ": " title[c] ": the report says '" stands "', this build '" cell[c] "'")
    }
}
END {
    for (t in used)
        if (row_count[t] != rows[t]) complain(used[t] ": the report has " rows[t] " rows, this build " row_count[t])
    if (compared == 0) complain("nothing was compared")
    printf "%d tables, %d figures compared\n", compared, figures
    exit failed
}
