# SPDX-License-Identifier: MIT
# The pictures of reality.md, from what reality.sh has in `data`; gnuplot -e "data='D'; out='O'".
set terminal pngcairo size 820,360 enhanced font 'DejaVu Sans,10'
set output out.'/reality.png'
set multiplot layout 1,2 margins 0.07,0.99,0.13,0.92 spacing 0.08
set xrange [0:1.6]; set xlabel 'time, s'; set ylabel 'drop of the markers, mm'; set yrange [*:*] reverse
set key top right
# Extremes of the measured mean: seconds after the release, mm; sampled at 100 Hz.
$gravity << END
0.05 10.07
0.12 2.18
0.18 9.07
0.25 3.41
0.31 8.27
0.38 4.28
0.44 7.69
0.51 4.85
0.57 7.31
0.64 5.23
END
$weight << END
0.11 24.66
0.23 8.11
0.34 22.34
0.46 10.59
0.58 20.73
0.69 12.42
0.81 19.39
0.92 13.81
1.03 18.57
1.15 14.72
END
array title[2] = ['gravity alone', 'with 0.510 N']
array at[2] = [6.45, 16.9]
set title title[1]
plot data.'/reality-0.dat' using 1:2 with lines lw 1.5 lc rgb '#1f5fa8' title 'computed, cells of 5 mm', \
     $gravity using 1:2 with points pt 7 ps 0.8 lc rgb '#b03030' title 'measured extremes', \
     at[1] with lines dt 2 lc rgb '#b03030' title 'measured at rest'
set title title[2]
plot data.'/reality-1.dat' using 1:2 with lines lw 1.5 lc rgb '#1f5fa8' notitle, \
     $weight using 1:2 with points pt 7 ps 0.8 lc rgb '#b03030' notitle, \
     at[2] with lines dt 2 lc rgb '#b03030' notitle
unset multiplot

set terminal pngcairo size 1000,340 enhanced font 'DejaVu Sans,9'
set output out.'/strip.png'
set multiplot layout 1,3 margins 0.06,0.99,0.15,0.9 spacing 0.07
set xrange [0:0.5]; set yrange [0:*] noreverse; set xlabel 'nominal strain'; set ylabel 'nominal stress, kPa or N/m'
set key top left reverse Left
set title 'stiffening, strain 0.2, cap 14'
plot data.'/strip-3.dat' using 1:2 with lines lw 1.5 lc rgb '#1f5fa8' title 'law', \
     data.'/strip-3.dat' every 50 using 1:3 with points pt 6 ps 1 lc rgb '#b03030' title 'solid, nu = 0.45', \
     data.'/strip-4.dat' every 50::25 using 1:3 with points pt 2 ps 1 lc rgb '#3a8f3a' title 'surface', \
     data.'/strip-0.dat' using 1:2 with lines dt 2 lc rgb '#909090' title 'linear'
set title 'half relaxes in 0.5 s'
plot for [k=0:2] data.sprintf('/strip-%d.dat', 5 + k) using 1:2 with lines lw 1.5 lc rgb '#1f5fa8' \
         title (k == 0 ? 'closed form' : ''), \
     data.'/strip-5.dat' every 120 using 1:3 with points pt 6 ps 1 lc rgb '#b03030' title '0.2/s', \
     data.'/strip-6.dat' every 25 using 1:3 with points pt 2 ps 1 lc rgb '#3a8f3a' title '1/s', \
     data.'/strip-7.dat' every 5 using 1:3 with points pt 4 ps 1 lc rgb '#d08a20' title '5/s'
set title 'fitted to other laws'
set xrange [0:0.6]; set yrange [0:1.05]; set ylabel 'stress over the largest'
array file[3] = ['ogden-9-14', 'toe-14', 'fung-1967']
array name[3] = ['Ogden, alpha 9', 'toe and line', 'Fung 1967']
array colour[3] = ['#b03030', '#3a8f3a', '#d08a20']
plot for [k=1:3] data.'/strip-'.file[k].'.dat' every 8 using 1:2 with points pt 6 ps 0.8 lc rgb colour[k] title name[k], \
     for [k=1:3] data.'/strip-'.file[k].'.dat' using 1:4 with lines lw 1.5 lc rgb colour[k] \
         title (k == 1 ? 'fits' : '')
unset multiplot
