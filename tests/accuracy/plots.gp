# SPDX-License-Identifier: MIT
# The report's pictures, from what pliant-accuracy wrote into `data`; gnuplot -e "data='D'; out='O'".
set terminal pngcairo size 820,340 enhanced font 'DejaVu Sans,10' linewidth 1.5
set grid lc rgb '#c0c0c0' lw 0.4
set datafile separator '\t'
set style data lines
grey = '#808080'; blue = '#1f5fa8'; red = '#b03030'

set output out.'/fig10.png'
set multiplot layout 1,2
set xlabel 'time [s]'
set ylabel 'displacement [mm]'
set key bottom right
set title 'Fabric, rule choi2005'
plot data.'/fig10-0.dat' skip 1 using 1:2 lc rgb grey title 'coarse', \
     '' skip 1 using 1:3 lc rgb blue title 'refined 1', \
     '' skip 1 using 1:6 lc rgb red dt 2 title 'adaptive 2'
set title 'Fabric, rule continuum'
plot data.'/fig10-0.dat' skip 1 using 1:7 lc rgb grey title 'coarse', \
     '' skip 1 using 1:9 lc rgb blue title 'refined 2', \
     '' skip 1 using 1:11 lc rgb red dt 2 title 'adaptive 2'
unset multiplot

do for [case in "sphere-1N sphere-0.2N stomach-0.6N"] {
    set output out.'/fig12-'.case.'.png'
    set multiplot layout 1,2
    set key top right
    do for [rule in "choi2005 continuum"] {
        set title case.', rule '.rule
        file = data.'/fig12-'.case.'-'.rule.'.dat'
        plot file skip 1 using 1:2 lc rgb grey title 'coarse', \
             '' skip 1 using 1:5 lc rgb blue title 'refined 2', \
             '' skip 1 using 1:6 lc rgb red dt 2 title 'adaptive 2'
    }
    unset multiplot
}

set terminal pngcairo size 1000,300 enhanced font 'DejaVu Sans,10'
set output out.'/fig11.png'
set multiplot layout 1,3
unset grid; unset key; unset border; unset tics; unset xlabel; unset ylabel
set view equal xyz; set view 75,20,1.5
do for [m in "1 0 3"] {
    set title word("refined coarse x adaptive", m + 1)
    splot data.'/fig11-1-'.m.'.dat' skip 1 using 1:2:($4 == 0 ? $3 : 1/0) with points pt 7 ps 0.4 lc rgb grey, \
          '' skip 1 using 1:2:($4 == 1 ? $3 : 1/0) with points pt 7 ps 0.6 lc rgb red
}
unset multiplot
