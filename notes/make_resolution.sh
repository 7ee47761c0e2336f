#!/usr/bin/env bash
# Make notes/resolution.md: plans and one drawn experiment for each density and noise, on simulated U2OS cells.
# Run from the project's folder, built; takes some five minutes of one processor. notes/make_resolution.sh [WORK_FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."
work=${1:-build/resolution}
mkdir -p "$work"
densities=${DENSITIES:-0.125 0.25 0.5 1}
noises=${NOISES:-0.01 0.03 0.09}
for noise in $noises; do
  for density in $densities; do
    answer=$work/$density-$noise.txt
    [ -s "$answer" ] && continue
    build/bin/mbtfm plan --quiet --noise_um "$noise" --beads_per_um2 "$density" --youngs_modulus_kPa 8.4 \
      --tension_nN 2 --drawn 1 --out "$work/$density-$noise" >"$answer.part"
    mv "$answer.part" "$answer"
  done
done
number() { # answer, text before it
  sed -n "s/.*$2 \([0-9.e-]*\) nN.*/\1/p" "$1"
}
rows() {
  for noise in $noises; do
    for density in $densities; do
      answer=$work/$density-$noise.txt
      network=$(number "$answer" "forces were off by")
      alone=$(number "$answer" "with the network, by")
      fttc=$(number "$answer" "without it, and by")
      planned=$(sed -n 's/.*standard error of \([0-9.e-]*\) nN with the network and \([0-9.e-]*\) nN without.*/\1 | \2/p' "$answer")
      apart=$(awk -F, '$4 == "adhesion force alone" {print $14}' "$work/$density-$noise/plan.csv")
      ratio=$(awk -v a="$alone" -v f="$fttc" -v n="$network" 'BEGIN {printf "%.1f | %.1f", a / n, f / n}')
      apart=$(awk -v d="$apart" 'BEGIN {if (d == "") print "never"; else printf "%.2g", d}')
      echo "| $density | $(awk -v n="$noise" 'BEGIN {print 1000 * n}') | $network | $alone | $fttc | $planned | $ratio | $apart |"
    done
  done
}
law() { # column of the error: exponents of noise and density, least squares of the logarithms
  awk -F'|' -v c="$1" '{x = log($3); z = log($2); y = log($c); n++; sx += x; sz += z; sy += y; sxx += x * x; szz += z * z
    sxz += x * z; sxy += x * y; szy += z * y}
    END {a = sxx - sx * sx / n; b = szz - sz * sz / n; d = sxz - sx * sz / n; e = sxy - sx * sy / n; f = szy - sz * sy / n
    printf "noise^%.2f · density^%.2f", (e * b - f * d) / (a * b - d * d), (f * a - e * d) / (a * b - d * d)}' "$work/rows"
}
rows >"$work/rows"
{
  sed -n '/^<<TOP$/,/^TOP$/p' "$0" | sed '1d;$d'
  cat "$work/rows"
  echo
  echo "## The law"
  echo
  echo "| error of | drawn, over the whole table |"
  echo "|---|---|"
  echo "| the network's adhesion forces | $(law 4) |"
  echo "| adhesion forces alone | $(law 5) |"
  echo "| FTTC | $(law 6) |"
  sed -n '/^<<REST$/,/^REST$/p' "$0" | sed '1d;$d'
} >notes/resolution.md
exit 0
<<TOP
# Resolution of single adhesions

How exactly do beads tell the force of one adhesion, by which method? Made by `notes/make_resolution.sh` with `mbtfm plan`; the same
for your cell: [planning](../docs/planning.md).

- **network**: the force of the adhesion in the tension fit (`mbtfm-fit`);
- **alone**: one force for each adhesion of the image, without a network (`mbtfm-traction --method adhesion-forces`);
- **FTTC**: a map of tractions, made without the image of the adhesions; an adhesion's force is the sum over it and 1.5 µm around it.

One simulated U2OS cell of 170 adhesions (1 nN on average) on 8.4 kPa; the segmentation has its usual errors. For each row one
experiment was drawn. Its errors are robust standard errors (1.48 times the median) of an adhesion's force along its direction, in nN.
*Planned* is what the plan predicts for the middle adhesion: the root mean square of eight draws of beads, which few draws without a
bead nearby raise. *Apart* is the distance from centre to centre at which two adhesions of
2 nN each are told apart without a network, in 8 of 10 experiments (predicted; drawn experiments agree within 15 %:
[how well plans hold](planning.md)). At 0.66 µm they touch; *never* means not even at 30 µm.

The middle adhesion of this cell carries 0.27 nN: a method that finds no force anywhere errs by 0.40 nN in these numbers.

On another gel the same numbers hold at the same product of noise and modulus: 30 nm on 8.4 kPa is 126 nm on 2 kPa.

![Three charts, one for each noise: error of an adhesion's force over the density of beads. With the network it stays below 0.1 nN.
Alone it falls from far above that to the network's error as beads get dense and exact. FTTC stays between 0.15 and 0.3 nN.](../docs/images/resolution.svg)

The charts were drawn with version 0.2.

| beads per µm² | noise (nm) | network | alone | FTTC | planned: network | planned: alone | alone / network | FTTC / network | apart (µm) |
|---|---|---|---|---|---|---|---|---|---|
TOP
<<REST

By the beads alone, an error grows in proportion to noise and modulus, and falls with the root of the density: noise^1 · density^-0.5.

- **With the network** the error hardly depends on the beads. What is left is the error of the mesh and of the segmentation.
- **Without it**, an adhesion needs beads of its own. Below one bead per µm² some adhesions have none nearby, and the error grows faster
  than the law.
- **FTTC** gains little from more or better beads: its error is that of the smoothing, and of neighbours within its 1.5 µm.

Model-based TFM therefore wins most where beads are few or noisy (columns *alone / network* and *FTTC / network*). With dense and exact
beads, forces alone come near to it, and they do not depend on the network. This page does not show the error of a fibre that is missing
in the network ([validation](validation.md)).

## What others found

- Sabass, Gardel, Waterman and Schwarz (Biophys. J. 94, 207, 2008) reconstructed tractions with a resolution of about 1 µm, by regularised
  FTTC and boundary elements, from beads of two colours. Both methods underestimate forces at small adhesions.
- Holenstein, Silvan and Snedeker (Sci. Rep. 7, 41633, 2017) found by simulation that traction maps become more than 35 % more accurate
  if the beads lie as densely and as near to the surface as possible.
- Soiné et al. (PLoS Comput. Biol. 11, e1004076, 2015) introduced the model-based method. The lower bounds of density and noise were left
  open; the table is an answer for cells of this kind.
REST
