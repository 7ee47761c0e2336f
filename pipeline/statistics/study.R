# Repeats the tables of this study in R, from fibres.csv, sheets.csv, adhesions_in_space.csv and cells.csv beside it, and compares them with
# types.csv, summaries.csv and tests.csv: Rscript study.R
# The mixed model needs the package metafor (install.packages("metafor")); without it that part is left out.

script <- sub("^--file=", "", grep("^--file=", commandArgs(FALSE), value = TRUE))
if (length(script) == 1) setwd(dirname(script))  # else: run by source() in this folder

fibres <- read.csv("fibres.csv", colClasses = c(cell = "character", condition = "character"))
types <- read.csv("types.csv", colClasses = c(cell = "character", condition = "character"))
tests <- read.csv("tests.csv")
fibres$condition[is.na(fibres$condition)] <- ""
types$condition[is.na(types$condition)] <- ""
if (!"edge" %in% types$type) fibres$type[fibres$type == "edge"] <- "ventral"
known <- subset(fibres, identifiable %in% c(TRUE, "TRUE"))
compared <- known$type != "unclassified" | "unclassified" %in% tests$group_b[tests$question == "between kinds"]

largest <- 0
compare <- function(what, here, there) {
  if (is.na(here) || is.na(there)) return(invisible())
  difference <- abs(here - there) / max(abs(there), 1e-9)
  largest <<- max(largest, difference)
  cat(sprintf("%-58s R: %-12.6g mbtfm: %-12.6g\n", what, here, there))
}

cat("Tensions by type (types.csv)\n")
for (i in which(types$cell == "all")) {
  row <- types[i, ]
  own <- known$tension_nN[known$condition == row$condition & known$type == row$type]
  name <- paste(row$condition, row$type)
  compare(paste(name, "n"), length(own), row$n_fibres)
  compare(paste(name, "mean (nN)"), mean(own), row$mean_nN)
  if (length(own) > 1) compare(paste(name, "SD (nN)"), sd(own), row$sd_nN)
}

cat("\nRank tests by fibre (tests.csv)\n")
rank <- subset(tests, quantity == "tension_nN" & unit == "observation")
for (i in seq_len(nrow(rank))) {
  row <- rank[i, ]
  within <- if (row$question == "between kinds") known$condition == row$within else known$type == row$within
  if (is.na(row$within) || row$within == "") within <- rep(TRUE, nrow(known))
  if (row$question == "between kinds") within <- within & compared
  group <- if (row$question == "between kinds") known$type else known$condition
  if (row$test == "Kruskal-Wallis") {
    h <- kruskal.test(known$tension_nN[within], factor(group[within]))
    compare(paste(row$within, "Kruskal-Wallis H"), unname(h$statistic), row$statistic)
    compare(paste(row$within, "Kruskal-Wallis p"), h$p.value, row$p)
  } else {
    a <- known$tension_nN[within & group == row$group_a]
    b <- known$tension_nN[within & group == row$group_b]
    u <- suppressWarnings(wilcox.test(a, b, exact = FALSE, correct = TRUE))
    name <- paste(row$within, row$group_a, "-", row$group_b)
    compare(paste(name, "Mann-Whitney U"), unname(u$statistic), row$statistic)
    compare(paste(name, "Mann-Whitney p"), u$p.value, row$p)
  }
}

sheets <- read.csv("sheets.csv", colClasses = c(cell = "character", condition = "character"))
cells <- read.csv("cells.csv", colClasses = c(cell = "character", condition = "character"))
of_sheets <- subset(cells, model == "sheet")
values <- sheets[sheets$enters %in% c(TRUE, "TRUE"), c("condition", "quantity", "kind", "value")]
figures <- c(mean_tension_nN_per_um = "mean_tension_nN_per_um", sheet_force_nN = "sheet_force_nN",
             strain_energy_fJ = "strain_energy_fJ", sheet_area_um2 = "cell_area_um2")
for (figure in names(figures)) {
  own <- of_sheets[!is.na(of_sheets[[figures[figure]]]), ]
  if (nrow(own) > 0) {
    values <- rbind(values, data.frame(condition = own$condition, quantity = figure, kind = "sheet",
                                       value = own[[figures[figure]]]))
  }
}
in_space <- subset(cells, model == "space")
for (figure in c("space_force_nN", "space_strain_energy_fJ", "space_contractile_moment_nN_um", "space_normal_share",
                 "space_largest_traction_kPa", "space_resolution_um")) {
  own <- in_space[!is.na(in_space[[figure]]), ]
  if (nrow(own) > 0) {
    values <- rbind(values, data.frame(condition = own$condition, quantity = figure, kind = "cell",
                                       value = own[[figure]]))
  }
}
adhesions <- read.csv("adhesions_in_space.csv", colClasses = c(cell = "character", condition = "character"))
if (nrow(adhesions) > 0) {
  values <- rbind(values, data.frame(condition = adhesions$condition, quantity = "space_adhesion_force_nN",
                                     kind = "adhesion", value = adhesions$force_nN))
}
if (nrow(values) > 0) {
  cat("\nFigures of the sheets and of the cells in space (summaries.csv)\n")
  values$condition[is.na(values$condition)] <- ""
  summaries <- read.csv("summaries.csv", colClasses = c(condition = "character"))
  summaries$condition[is.na(summaries$condition)] <- ""
  for (i in which(summaries$quantity %in% values$quantity)) {
    row <- summaries[i, ]
    own <- values$value[values$quantity == row$quantity & values$condition == row$condition & values$kind == row$kind]
    name <- paste(row$condition, row$kind, row$quantity)
    compare(paste(name, "n"), length(own), row$n_observations)
    compare(paste(name, "mean"), mean(own), row$mean)
    if (length(own) > 1) compare(paste(name, "SD"), sd(own), row$sd)
  }
  cat("\nRank tests of these between conditions (tests.csv)\n")
  rank <- subset(tests, quantity %in% values$quantity & test == "Mann-Whitney" & question == "between conditions" &
                   unit != "cell median")
  for (i in seq_len(nrow(rank))) {
    row <- rank[i, ]
    own <- subset(values, quantity == row$quantity & kind == row$within)
    u <- suppressWarnings(wilcox.test(own$value[own$condition == row$group_a], own$value[own$condition == row$group_b],
                                      exact = FALSE, correct = TRUE))
    name <- paste(row$quantity, row$group_a, "-", row$group_b)
    compare(paste(name, "Mann-Whitney U"), unname(u$statistic), row$statistic)
    compare(paste(name, "Mann-Whitney p"), u$p.value, row$p)
  }
}

if (requireNamespace("metafor", quietly = TRUE) && nrow(known) > 0 && !anyNA(known$sigma_nN)) {
  cat("\nMeans of the mixed model (types.csv; other optimiser, small differences are expected)\n")
  known$group <- factor(paste(known$condition, known$type))
  known$cell_type <- paste(known$cell, known$type)
  known$fibre <- paste(known$cell, known$fibre_id)
  model <- suppressWarnings(metafor::rma.mv(
    tension_nN, sigma_nN^2, mods = ~ 0 + group,
    random = list(~ 1 | cell, ~ 1 | cell_type, ~ type | fibre), struct = "DIAG", data = known))
  for (i in which(types$cell == "all")) {
    name <- paste(types$condition[i], types$type[i])
    cat(sprintf("%-58s R: %-12.6g mbtfm: %-12.6g\n", name, coef(model)[paste0("group", name)], types$model_mean_nN[i]))
  }
}

cat(sprintf("\nLargest relative difference, without the mixed model: %.2g\n", largest))
if (largest > 1e-4) stop("R and mbtfm differ")
