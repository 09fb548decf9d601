# SPDX-License-Identifier: MIT
# The demo's pictures, from what pliant-monitor and pliant-probe wrote of the messages.
# gnuplot -e "out='FOLDER'; t0=START; t1=END; shape=1" clients/demo.gp; times are simulated seconds; shape 0: not the body.
set terminal pngcairo size 1200,700 enhanced font 'DejaVu Sans,15' linewidth 2
set grid lc rgb '#b0b0b0' lw 0.5
set xlabel 'simulated time since the probe began [s]'
set xrange [-0.5:t1 - t0]

set output out.'/displacement.png'
set title 'Largest displacement of all nodes'
set ylabel 'displacement [mm]'
set yrange [0:*]
unset key
plot out.'/displacement.tsv' using ($1 - t0):($2 * 1e3) with lines lc rgb '#1f5fa8'

set output out.'/force.png'
set title 'What the probe felt'
set ylabel 'force [N]'
set y2label 'depth of the overlap [mm]'
set ytics nomirror
set y2tics
set y2range [0:*]
set key top right
plot out.'/probe.tsv' using ($2 - t0):(sqrt($6**2 + $7**2 + $8**2)) with lines lc rgb '#b03030' \
         title 'force |F|', \
     '' using ($2 - t0):($12 * 1e3) axes x1y2 with lines lc rgb '#909090' title 'depth'

if (!shape) exit
reset
set terminal pngcairo size 1100,1000 enhanced font 'DejaVu Sans,15'
set output out.'/shape.png'
set title 'The body at its largest displacement' offset 0,-1
set xlabel 'x [mm]' offset 0,-1
set ylabel 'y [mm]' offset 0,-1
set zlabel 'z [mm]' rotate parallel
set cblabel 'displacement [mm]'
set view 72,330,1.35
set view equal xyz
set xyplane relative 0.05
# The same ticks on all axes, four to ten on the longest.
stats out.'/peak.dat' using ($1 * 1e3) name 'X' nooutput
stats out.'/peak.dat' using ($2 * 1e3) name 'Y' nooutput
stats out.'/peak.dat' using ($3 * 1e3) name 'Z' nooutput
max(a, b) = a > b ? a : b
span = max(X_max - X_min, max(Y_max - Y_min, Z_max - Z_min))
decade = 10 ** floor(log10(span))
step = decade * (span / decade < 2 ? 0.25 : span / decade < 5 ? 0.5 : 1)
set xtics step
set ytics step
set ztics step
set palette defined (0 '#f2e6d8', 0.35 '#f0b27a', 0.7 '#d35445', 1 '#7b1e3a')
set pm3d depthorder corners2color mean border lc rgb '#70402020' lw 0.4
set pm3d lighting primary 0.35 specular 0
unset key
splot out.'/peak.dat' using ($1 * 1e3):($2 * 1e3):($3 * 1e3):($4 * 1e3) with pm3d
