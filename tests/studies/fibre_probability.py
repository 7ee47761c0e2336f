#!/usr/bin/env python3
"""fibre_probability.py FILE...: the coefficients of segment/cells/fibre_probability.cpp or, of adhesions, adhesions.cpp, and how
well they are calibrated.

FILE: what `fibre_accuracy lines` or `segmentation_accuracy clutter` printed. The coefficients are those of a logistic regression by Newton's method with a weak normal
prior (standard deviation 1.8, not of the constant). A quarter of the cells at a time is stated by the fit to the others.
"""
import csv
import math
import sys

PRIOR = 0.3  # precision


def solved(matrix, rhs):
    rows = [row + [b] for row, b in zip(matrix, rhs)]
    for i in range(len(rows)):
        pivot = max(range(i, len(rows)), key=lambda r: abs(rows[r][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for r in range(len(rows)):
            if r != i:
                factor = rows[r][i] / rows[i][i]
                rows[r] = [a - factor * b for a, b in zip(rows[r], rows[i])]
    return [row[-1] / row[i] for i, row in enumerate(rows)]


def probability(coefficients, terms):
    return 1 / (1 + math.exp(-max(-30, min(30, sum(a * x for a, x in zip(coefficients, terms))))))


def fitted(lines):
    n = len(lines[0][2])
    a = [0.0] * n
    for _ in range(30):
        slope = [-PRIOR * a[i] if i else 0 for i in range(n)]
        curvature = [[PRIOR if i == j and i else 0.0 for j in range(n)] for i in range(n)]
        for _, is_true, x in lines:
            p = probability(a, x)
            for i in range(n):
                slope[i] += (is_true - p) * x[i]
                for j in range(n):
                    curvature[i][j] += p * (1 - p) * x[i] * x[j]
        a = [b + step for b, step in zip(a, solved(curvature, slope))]
    return a, curvature


def calibration(stated):
    low = 0
    for high in (0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 1.01):
        some = [(p, t) for p, t in stated if low <= p < high]
        if some:
            n = len(some)
            print(f"  stated {sum(p for p, _ in some) / n:.2f}, true {sum(t for _, t in some) / n:.2f}, {n}")
        low = high


lines = []
for name in sys.argv[1:]:
    for row in csv.reader(open(name)):
        lines.append((tuple(row[:3]), int(row[3]), [float(x) for x in row[5:]]))
a, curvature = fitted(lines)
for i, value in enumerate(a):
    unit = [float(i == j) for j in range(len(a))]
    print(f"{value:8.3f} ± {math.sqrt(solved(curvature, unit)[i]):.3f}")
cells = sorted({cell for cell, _, _ in lines})
stated = []
for k in range(4):
    apart = set(cells[k::4])
    b, _ = fitted([line for line in lines if line[0] not in apart])
    stated += [(probability(b, x), t) for cell, t, x in lines if cell in apart]
print("cells that the fit has not seen:")
calibration(stated)
print("the program's own:")
calibration([(float(row[4]), int(row[3])) for name in sys.argv[1:] for row in csv.reader(open(name))])
