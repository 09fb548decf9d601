# SPDX-License-Identifier: MIT
# The matrix as a picture: awk -f draw.awk matrix.tsv >matrix.svg. Cases down, models across; in each field a stripe for
# each integrator and precision, coloured by verdict.
BEGIN {
    FS = "\t"
    colour["rest"] = "#3f9b57"; colour["bounded"] = "#a9d18e"; colour["reset"] = "#f0a030"; colour["refused"] = "#9db4c8"
    colour["swelled"] = colour["trembles"] = colour["sinks"] = "#9050b0"; colour["FAILED"] = "#d02020"
    left = 250; top = 150; stripe = 7; row = 13
}
NR == 1 { stripes = NF - 2; for (c = 3; c <= NF; c++) title[c - 2] = $c; next }
{
    if (!($1 in model)) { model[$1] = ++models; name[models] = $1 }
    if (!($2 in place)) { place[$2] = ++cases; label[cases] = $2 }
    for (c = 1; c <= stripes; c++) { split($(c + 2), word, /[ ,]/); verdict[place[$2], model[$1], c] = word[1] }
}
END {
    wide = stripes * stripe + 6
    width = left + models * wide + 90; height = top + cases * row + 40
    printf "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" font-family=\"sans-serif\" font-size=\"10\">\n", width, height
    printf "<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n", width, height
    for (m = 1; m <= models; m++)
        printf "<text transform=\"translate(%d,%d) rotate(-45)\">%s</text>\n", left + (m - 0.6) * wide, top - 6, name[m]
    for (k = 1; k <= cases; k++) {
        y = top + (k - 1) * row
        printf "<text x=\"%d\" y=\"%d\" text-anchor=\"end\">%s</text>\n", left - 6, y + 10, label[k]
        for (m = 1; m <= models; m++)
            for (c = 1; c <= stripes; c = d) {
                v = verdict[k, m, c]
                for (d = c + 1; d <= stripes && verdict[k, m, d] == v; d++) ;
                if (v in colour)
                    printf "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"%s\"/>\n",
                        left + (m - 1) * wide + (c - 1) * stripe, y, (d - c) * stripe, row - 2, colour[v]
            }
    }
    x = left; y = top + cases * row + 14
    n = split("rest bounded reset refused trembles FAILED", shown, " ")
    for (i = 1; i <= n; i++) {
        printf "<rect x=\"%d\" y=\"%d\" width=\"12\" height=\"11\" fill=\"%s\"/><text x=\"%d\" y=\"%d\">%s</text>\n",
            x, y, colour[shown[i]], x + 16, y + 10, shown[i] == "trembles" ? "trembles, sinks, swelled" : shown[i]
        x += shown[i] == "trembles" ? 150 : 80
    }
    print "</svg>"
}
