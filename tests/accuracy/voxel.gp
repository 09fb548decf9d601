# SPDX-License-Identifier: MIT
# The voxel report's pictures, from what voxel.sh has in `data`; gnuplot -e "data='D'; out='O'".
set datafile separator '\t'
set style line 1 lc rgb '#1f5fa8' lw 1.5
set style line 2 lc rgb '#b03030' lw 1.5
set style line 3 lc rgb '#808080' lw 1.5
set style line 4 lc rgb '#2a8a3a' lw 1.5
array colour[4] = ['#e8eef6', '#9cc3e6', '#f2c063', '#d9705a']
font = 'DejaVu Sans,10'

# --- Fig. 4 ---
set terminal pngcairo size 820,430 enhanced font font
set output out.'/voxel-disc.png'
set multiplot layout 1,2 margins 0.01,0.99,0.02,0.93 spacing 0.02
unset key; unset border; unset tics
set size ratio -1
set xrange [-0.7:32.7]; set yrange [-0.7:32.7]
set style fill solid border
do for [name in "full graded"] {
    file = data.'/disc-'.name.'.dat'
    set title name eq 'full' ? '812 elements, 877 vertices' : '172 elements, 281 vertices'
    plot for [l = 0:3] file index l using 1:2 with filledcurves closed lc rgb colour[l + 1], \
         for [l = 0:3] file index l using 1:2 with lines lc rgb '#404048' lw 0.7, \
         file index 4 using 1:2 with points pt 7 ps 0.35 lc rgb '#202028'
}
unset multiplot

# --- Figs 6 and 8 ---
set terminal pngcairo size 820,230 enhanced font font
set output out.'/voxel-carved.png'
set multiplot layout 1,4 margins 0.01,0.99,0.02,0.90 spacing 0.01
set xrange [-16.5:16.5]; set yrange [-16.5:16.5]
set arrow 1 from 0,-16 to 0,0 nohead front lc rgb '#b03030' lw 2
array when[4] = ['before', 'one tick after', 'two', 'at the end']
do for [f = 0:3] {
    file = data.'/carved-'.f.'.dat'
    set title when[f + 1]
    plot for [l = 0:3] file index l using 1:2 with filledcurves closed lc rgb colour[l + 1], \
         for [l = 0:3] file index l using 1:2 with lines lc rgb '#404048' lw 0.7
}
unset multiplot

unset arrow 1

# --- Fig. 9 ---
set terminal pngcairo size 820,250 enhanced font font
set output out.'/voxel-torn.png'
set multiplot layout 1,4 margins 0.01,0.99,0.02,0.90 spacing 0.01
set xrange [-42:42]; set yrange [-46:38]
do for [f = 0:3] {
    file = data.'/torn-'.f.'.dat'
    set title sprintf('%d mm deep', 7 * f)
    plot for [l = 0:3] file index l using 1:2 with filledcurves closed lc rgb colour[l + 1], \
         for [l = 0:3] file index l using 1:2 with lines lc rgb '#404048' lw 0.5, \
         file index 4 using 1:2 with filledcurves closed lc rgb '#606068'
}
unset multiplot

# --- Figs 2 and 10 ---
set terminal pngcairo size 820,390 enhanced font font
set output out.'/voxel-cube.png'
set multiplot
set origin 0,0; set size 0.5,1; set size ratio -1
set lmargin 1; set rmargin 1; set tmargin 2; set bmargin 1
set title 'n = 32, one eighth taken away; levels 0 to 3'
load data.'/cube-open.gp'
plot NaN notitle
unset object
set border; set tics; set key right bottom; set grid lc rgb '#c0c0c0' lw 0.4
set origin 0.5,0; set size noratio; set size 0.5,1
set lmargin 8; set rmargin 2; set tmargin 2; set bmargin 3.5
set title 'elements of a cube of n x n x n cells'
set xlabel 'n'; set ylabel 'elements / n^2'
set xrange [0:165]; set yrange [0:16]
set style data linespoints
plot 8 with lines ls 3 dt 2 title '8: the paper', 14 with lines ls 3 dt 3 title '14: limit of the split', \
     x with lines ls 4 dt 2 title 'n: every cell', \
     data.'/cube-counts.dat' skip 1 using 1:2 ls 1 pt 7 ps 0.6 title 'remainder kept', \
     '' skip 1 using 1:3 ls 2 pt 7 ps 0.6 title 'split in eight'
unset multiplot
unset xlabel; unset ylabel; unset grid
set origin 0,0; set size noratio; set size 1,1

# --- Fig. 3 ---
set terminal pngcairo size 1000,370 enhanced font font
set output out.'/voxel-press.png'
set multiplot layout 1,3 margins 0.01,0.99,0.02,0.92 spacing 0.02
unset key; unset border; unset tics
set size ratio -1
set xrange [-56:56]; set yrange [-52:62]
set object 1 circle at 0,60 size 30 arc [180:360] nowedge fillstyle empty border lc rgb '#a0a0a0' lw 1.2
slice = "data.'/press-'.name.'.dat'"
do for [m in "graded both full"] {
    set title m eq 'graded' ? '(a) graded, level 2' : m eq 'full' ? '(c) every cell' : '(b) outlines'
    if (m eq 'both') {
        plot data.'/press-full.dat' index 4 with lines lc rgb '#b03030' lw 1, \
             data.'/press-graded.dat' index 4 with lines lc rgb '#1f5fa8' lw 2.5 dt 2
    } else {
        file = data.'/press-'.m.'.dat'
        plot for [l = 0:3] file index l using 1:2 with filledcurves closed lc rgb colour[l + 1], \
             for [l = 0:3] file index l using 1:2 with lines lc rgb '#404048' lw 0.6
    }
}
unset multiplot
unset object

# --- Fig. 11 ---
set terminal pngcairo size 900,400 enhanced font font
set output out.'/voxel-times.png'
set size noratio
set lmargin 34; set rmargin 3; set tmargin 3; set bmargin 3
set border 1; set xtics nomirror; set ytics nomirror scale 0
set xrange [0:100]
rows = system("wc -l < '".data."/bars.dat'") + 0
set yrange [rows - 0.4:-0.6]
unset title; set xlabel "share of a step's time [%]"
set key outside top center horizontal samplen 1 width -3 maxrows 1
array process[5] = ['a elastic force', 'b reconstruction', 'c summation', 'd update', 'e collision']
array tint[5] = ['#1f5fa8', '#d0a030', '#7fb2dc', '#2a8a3a', '#b03030']
low(k) = k == 1 ? 0 : k == 2 ? column(2) : k == 3 ? column(2) + column(3) : \
         k == 4 ? column(2) + column(3) + column(4) : column(2) + column(3) + column(4) + column(5)
plot for [k = 1:5] data.'/bars.dat' using (low(k)):0:(low(k)):(low(k) + column(k + 1)):($0 - 0.35):($0 + 0.35):ytic(1) \
     with boxxyerror fs solid noborder lc rgb tint[k] title process[k]
unset key; unset xlabel

# --- bending ---
set terminal pngcairo size 560,340 enhanced font font
set output out.'/voxel-bending.png'
set lmargin 8; set rmargin 2; set tmargin 2; set bmargin 3.5
set border; set xtics ('1' 1, '2' 2, '4' 4, '8' 8); set ytics autofreq scale 1
set logscale x 2; set xrange [0.9:9]; set yrange [0:1.1]
set grid lc rgb '#c0c0c0' lw 0.4
set xlabel 'elements through the thickness'; set ylabel 'deflection / Timoshenko'
set title 'cantilever, nu = 0'
set key default; set key inside right bottom vertical
set style data linespoints
file = data.'/cantilever.tsv'
plot file skip 1 every ::0::3 using 2:3 ls 1 pt 7 title 'affine', '' skip 1 every ::0::3 using 2:4 ls 2 pt 7 title 'miyazaki2004', \
     '' skip 1 every ::0::3 using 2:5 with points lc rgb '#2a8a3a' pt 6 ps 1.8 lw 1.5 title 'C3D8I', '' skip 1 every ::0::3 using 2:6 ls 3 dt 2 pt 6 title 'C3D8'
unset logscale; unset xlabel; unset ylabel; unset grid; unset key

# --- the organ ---
set terminal pngcairo size 900,300 enhanced font font
set output out.'/voxel-organ.png'
unset border; unset tics
set size ratio -1
set lmargin 0; set rmargin 0; set tmargin 2; set bmargin 0.5
set multiplot layout 1,3 margins 0.01,0.99,0.02,0.9 spacing 0.02
titles = "'elements of a layer, green: stiff' 'surface at rest' 'pressed by 15 mm; red: moved'"
do for [k = 1:3] {
    set title word(titles, k)
    load data.'/organ-'.word('layer rest pressed', k).'.gp'
    plot NaN notitle
    unset object
}
unset multiplot
