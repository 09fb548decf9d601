# SPDX-License-Identifier: MIT
# Reads a study's runs.tsv and prints two tables, by interpolation along its curves (log-log):
#   what=time   run time at `limit` (a fraction) of error in time, by method and mesh, and over that
#               of RK4
#   what=detail run time of adaptive bodies over that of wholly refined ones with the same total error
# awk -F '\t' -v what=time -v limit=0.01 -v scene=NAME -f study_figures.awk runs.tsv
NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
$at["verdict"] != "ok" { next }
{
    method = $at["integrator"] ($at["step_doubling"] == 1 ? " with step doubling" : "") ", " $at["precision"]
    mesh = $at["name"]; sub(/^[^,]*, /, "", mesh)
    cost = $at["cpu_median"]
}
what == "time" && $at["time_patch"] != "-" {
    put("t" SUBSEP mesh SUBSEP method, cost, $at["time_patch"])
    if (!(mesh in known)) { known[mesh] = 1; meshes[++mesh_count] = mesh }
    if (!(method in seen)) { seen[method] = 1; methods[++method_count] = method }
}
what == "detail" && $at["total_patch"] != "-" && $at["integrator"] == "leapfrog" &&
    $at["precision"] == "single" && $at["paper_rule"] == 0 && $at["time_step_asked"] == 0 {
    if (mesh ~ /^level/) { level[$at["level"]] = 1; held_cost[$at["level"]] = cost; held_error[$at["level"]] = $at["total_patch"] }
    else if (!(mesh in adaptive)) { adaptive[mesh] = ++adaptive_count; name[adaptive_count] = mesh; own_cost[adaptive_count] = cost; own_error[adaptive_count] = $at["total_patch"] }
}
# A point of a curve, kept in the order of rising cost.
function put(curve, cost, error,    i) {
    for (i = ++points[curve]; i > 1 && costs[curve, i - 1] > cost; i--) {
        costs[curve, i] = costs[curve, i - 1]; errors[curve, i] = errors[curve, i - 1]
    }
    costs[curve, i] = cost; errors[curve, i] = error
}
function between(x, x0, x1, y0, y1) { return x0 == x1 ? y0 : exp(log(y0) + (log(y1) - log(y0)) * (log(x) - log(x0)) / (log(x1) - log(x0))) }
# The least cost at which a curve is within the limit; "": never. Left of its first point there is none:
# the longest stable step.
function cost_at(curve, limit,    i) {
    for (i = 1; i <= points[curve]; i++)
        if (errors[curve, i] + 0 <= limit)
            return i == 1 || errors[curve, i - 1] + 0 <= limit ? costs[curve, i] : between(limit, errors[curve, i - 1], errors[curve, i], costs[curve, i - 1], costs[curve, i])
    return ""
}
function shown(cost) { return cost == "" ? "not reached" : sprintf("%.3g", 1000 * cost) }
function shown_of(curve, cost) { return points[curve] == 0 ? "-" : shown(cost) }
function ratio(own, of) { return own == "" || of == "" ? "-" : sprintf("%.2f", own / of) }
END {
    if (what == "time")
        for (m = 1; m <= mesh_count; m++) {
            mesh = meshes[m]
            of = "t" SUBSEP mesh SUBSEP
            own = cost_at(of "leapfrog, single", limit)
            single = cost_at(of "rk4, single", limit)
            double = cost_at(of "rk4, double", limit)
            doubling = cost_at(of "rk4 with step doubling, single", limit)
            if (own == "" && single == "") continue
            printf "%s\t%s\t%s\t%s\t%s\t%s\t%s\t%s\t%s\n", scene, mesh, shown_of(of "leapfrog, single", own), shown_of(of "rk4, single", single), shown_of(of "rk4, double", double), shown_of(of "rk4 with step doubling, single", doubling), ratio(own, single), ratio(own, double), ratio(own, doubling)
        }
    if (what == "detail")
        for (a = 1; a <= adaptive_count; a++) {
            of = ""
            least = ""
            for (l in level) if (least == "" || held_error[l] + 0 < held_error[least] + 0) least = l
            # Nearer than any level: beside the nearest of them, which errs more.
            if (least != "" && own_error[a] + 0 < held_error[least] + 0) {
                printf "%s\t%s\t%.3g %%\t%s\tlevel %d, %.3g %%: %s\tbelow %s\n", scene, name[a], 100 * own_error[a], shown(own_cost[a]), least, 100 * held_error[least], shown(held_cost[least]), ratio(own_cost[a], held_cost[least])
                continue
            }
            for (l = 0; (l + 1) in level; l++)
                if (own_error[a] + 0 <= held_error[l] + 0 && own_error[a] + 0 >= held_error[l + 1] + 0)
                    of = between(own_error[a], held_error[l], held_error[l + 1], held_cost[l], held_cost[l + 1])
            printf "%s\t%s\t%.3g %%\t%s\t%s\t%s\n", scene, name[a], 100 * own_error[a], shown(own_cost[a]), of == "" ? "-" : shown(of), ratio(own_cost[a], of)
        }
}
