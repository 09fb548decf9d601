# SPDX-License-Identifier: MIT
# The report's picture of the beam, from study_outside.sh: gnuplot -e "data='D'; out='O'".
set terminal pngcairo size 1000,480 font 'DejaVu Sans,11'
set output out.'/study-beam.png'
set encoding utf8
set logscale xy
set grid back lc rgb '#c8c8c8' lw 0.8 dt 3
set key outside right top Left reverse noenhanced samplen 1.5
set key title 'numbers: elements through the thickness'
set xlabel 'processor time [ms]: solid bodies for a simulated second, CalculiX to rest, once'
set ylabel 'deflection off by [%]'
set title 'Bending of a cantilever'
set format xy '%g'
set yrange [0.05:100]
set datafile separator '\t'
row(name) = sprintf("< awk -F '\t' -v OFS='\t' '$1 == \"%s\" { e = $3 < 0 ? -$3 : $3 + 0; if (e > 0) { split($4, c, \" \"); print c[1], e, $2 } }' %s/beam.tsv", name, data)
plot row('affine') using 1:2 with linespoints pt 7 lc rgb '#1f5fa8' title 'solid, affine (ours)', \
     '' using 1:2:3 with labels left offset 0.8,0.4 font ',8' tc rgb '#1f5fa8' notitle, \
     row('miyazaki2004') using 1:2 with linespoints pt 5 lc rgb '#b03030' title 'solid, miyazaki2004', \
     '' using 1:2:3 with labels left offset 0.8,0.4 font ',8' tc rgb '#b03030' notitle, \
     row('CalculiX C3D8I') using 1:2 with linespoints pt 9 lc rgb '#3a8f3a' title 'CalculiX C3D8I', \
     '' using 1:2:3 with labels left offset 0.8,0.4 font ',8' tc rgb '#3a8f3a' notitle, \
     row('CalculiX C3D8') using 1:2 with linespoints pt 11 lc rgb '#d08a20' title 'CalculiX C3D8', \
     '' using 1:2:3 with labels left offset 0.8,0.4 font ',8' tc rgb '#d08a20' notitle
