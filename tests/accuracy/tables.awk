# Fills a report's template: a line "@table NAME" becomes the table DATA/NAME.tsv. awk -v data=DATA
function cells(line,    n, cell, i, row) {
    n = split(line, cell, "\t")
    row = "|"
    for (i = 1; i <= n; i++) row = row " " cell[i] " |"
    return row
}
!/^@table / { print; next }
{
    file = data "/" substr($0, 8) ".tsv"
    for (row = 0; (getline line < file) > 0; row++) {
        print cells(line)
        if (row == 0) { gsub(/[^\t]+/, "---", line); print cells(line) }
    }
    if (row < 2) { print "tables.awk: no table " file > "/dev/stderr"; exit 1 }
    close(file)
}
