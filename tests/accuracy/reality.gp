# The picture of reality.md, from what reality.sh has in `data`; gnuplot -e "data='D'; out='O'".
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
