# SPDX-License-Identifier: MIT
# Puts the pages of several certificates side by side: a row a figure, a column a scene; what misses its bar is bold.
BEGIN { FS = " *[|] *" }
FNR == 1 { sub(/^# Touch: /, ""); head = head " " $0 " |"; line = line "---|" }
/^[|] `/ {
    if (!($2 in row)) { name[++count] = $2; row[$2] = "| " $2 " | " $4 " | " $5 " | " $6 " |" }
    row[$2] = row[$2] " " ($7 == "missed" ? "**" $3 "**" : $3) " |"
}
END {
    print "| | unit | least | most |" head
    print "|---|---|---|---|" line
    for (k = 1; k <= count; k++) print row[name[k]]
}
