# SPDX-License-Identifier: MIT
# Error against run time of one pressed solid: gnuplot -e "table='T'; scene='S'; picture='P'".
set terminal pngcairo size 1000,600 font 'DejaVu Sans,11'
set output picture
set encoding utf8
set datafile separator '\t'
set logscale xy
set grid back lc rgb '#c8c8c8' lw 0.8 dt 3
set key below Left reverse noenhanced samplen 1.5 maxrows 3
set key title 'numbers: levels, and the error to which it is steered'
set xlabel 'processor time of a tick under contact [ms]'
set ylabel 'off all cells by [%]'
set title scene noenhanced
set format xy '%g'
set offsets graph 0.05, graph 0.05, graph 0.02, graph 0.02
# Ways by whether elements follow the tool and are steered; column: which error. Zero has no logarithm.
rows(adapts, steered, column) = sprintf("< awk -F '\t' -v OFS='\t' 'NR > 1 && $3 == %d && ($2 ~ / to /) == %d && $%d > 0 { way = $2; sub(/^[a-z]* /, \"\", way); print $5, $%d, way }' '%s'", adapts, steered, column, column, table)
blue = '#1f5fa8'; red = '#b03030'; green = '#3a8f3a'
plot rows(0, 0, 7) using 1:2 with linespoints pt 7 lc rgb blue title 'levels inside: displacements', \
     '' using 1:2:3 with labels left offset 0.8,0.4 font ',8' tc rgb blue notitle, \
     rows(0, 0, 8) using 1:2 with linespoints pt 6 dt 2 lc rgb blue title 'force on the tool', \
     rows(1, 0, 7) using 1:2 with linespoints pt 7 lc rgb red title 'elements that follow the tool: displacements', \
     '' using 1:2:3 with labels left offset 0.8,0.4 font ',8' tc rgb red notitle, \
     rows(1, 0, 8) using 1:2 with linespoints pt 6 dt 2 lc rgb red title 'force on the tool', \
     rows(1, 1, 7) using 1:2 with points pt 5 lc rgb green title 'steered by their error: displacements', \
     '' using 1:2:3 with labels left offset 0.8,0.4 font ',8' tc rgb green notitle, \
     rows(1, 1, 8) using 1:2 with points pt 4 lc rgb green title 'force on the tool'
