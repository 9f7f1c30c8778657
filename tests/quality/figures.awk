# SPDX-License-Identifier: GPL-3.0-or-later
# Makes a row of the quality table from a report of `qmat mat --report`:
#   awk -v model=NAME -v epsilon=1% -f figures.awk REPORT
# Errors are percent of the diagonal, rounded up to a thousandth. A Betti number that the report does not state is "-".
function round_up(x, thousandths) {
  thousandths = int(x * 1e5)
  return sprintf("%.3f", (thousandths < x * 1e5 - 1e-6 ? thousandths + 1 : thousandths) / 1000)
}
function betti(suffix) {
  return figure("components" suffix) " " figure("loops" suffix) " " figure("voids" suffix)
}
function figure(key) { return key in figures ? figures[key] : "-" }

/"type": "medial.evaluate"/ { found = 1 }
found && match($0, /"[a-z_]+": [-+.0-9a-z]+,?$/) {
  split(substr($0, RSTART), pair, /[":, ]+/)
  if (!(pair[2] in figures)) figures[pair[2]] = pair[3]
}
END {
  if (!("surface_to_envelope" in figures) || !("spheres" in figures)) exit 1
  certified = figures["certified"] == "true" ? "yes" : "no"
  print model, epsilon, figures["spheres"], round_up(figures["surface_to_envelope"]), \
    round_up(figures["envelope_to_surface"]), certified, betti(""), betti("_of_solid")
}
