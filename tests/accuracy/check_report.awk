# SPDX-License-Identifier: MIT
# Compares tables of figures with the committed ones of the same name: awk -v results=FOLDER -f check_report.awk DATA...
# A column of DATA is found in the committed table by its title; the second of a title is TITLE#2. All figures must be
# equal as they are printed: the same scene gives the same bits on every machine, so there is no tolerance but the
# rounding to the digits shown. Columns that say how long something took are left out.
function timed(title) { return title ~ /\[[mu]s\]|^[mun]s |saved|times faster|per element/ }
function complain(what) { print "check_report: " what > "/dev/stderr"; failed = 1 }
# The committed table of DATA: its rows and the columns of its titles.
function open_committed(    name, line, n, c, cell, count) {
    name = FILENAME
    sub(/^.*\//, "", name)
    sub(/-own\.tsv$/, ".tsv", name) # CalculiX's columns are added to it
    rows = -1
    split("", column)
    while ((getline line < (results "/" name)) > 0) {
        n = split(line, cell, "\t")
        if (++rows == 0)
            for (c = 1; c <= n; c++) column[cell[c] (count[cell[c]]++ ? "#" count[cell[c]] : "")] = c
        else
            committed[rows] = line
    }
    close(results "/" name)
    if (rows < 0) complain("no table " results "/" name)
    compared++
}
FNR == 1 {
    if (row != rows) complain(before ": " rows " rows are committed, this build has " row)
    open_committed()
    before = FILENAME; row = 0
    split("", count)
    titles = split($0, title, "\t")
    for (c = 1; c <= titles; c++) {
        if (count[title[c]]++) title[c] = title[c] "#" count[title[c]]
        if (rows >= 0 && !(title[c] in column)) complain(FILENAME ": no column " title[c] " is committed")
    }
    next
}
{
    m = split($0, cell, "\t")
    split(committed[++row], known, "\t")
    for (c = 1; c <= titles; c++) {
        if (timed(title[c]) || row > rows) continue
        stands = known[column[title[c]]]
        figures++
        if (stands != (c <= m ? cell[c] : ""))
            complain(FILENAME ":" FNR ": " title[c] ": '" stands "' is committed, this build has '" cell[c] "'")
    }
}
END {
    if (row != rows) complain(before ": " rows " rows are committed, this build has " row)
    if (compared == 0) complain("nothing was compared")
    printf "%d tables, %d figures compared\n", compared, figures
    exit failed
}
