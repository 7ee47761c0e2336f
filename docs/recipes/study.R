# The study as one tidy frame in R, without packages: source("study.R"); fibres <- mbtfm_study("STUDY")
#
# A row for each fibre of each cell: columns of tensions.csv (docs/columns.md) and `cell`, the path below the folder.
# Cells that `mbtfm stats` leaves out are left out, and named; with_left_out = TRUE keeps their rows, with `included` FALSE
# and the `reason`.

# By cell: is it included, and why not. Without the program, what `mbtfm stats` has last written counts.
mbtfm_cells <- function(folder, program = "mbtfm") {
  written <- file.path(folder, "statistics", "cells.csv")
  if (nzchar(Sys.which(program))) {
    text <- system2(program, c("stats", shQuote(folder), "--list", "--quiet"), stdout = TRUE)
    if (!is.null(attr(text, "status"))) stop(folder, ": mbtfm stats failed")
    return(read.csv(text = text, colClasses = "character"))
  }
  if (!file.exists(written)) stop(program, " is not on the PATH: install it, or run mbtfm stats ", folder, " where it is")
  cells <- read.csv(written, colClasses = "character")
  if (is.null(cells$fibres_left_out)) cells$fibres_left_out <- ""
  cells[c("cell", "condition", "included", "reason", "fibres_left_out")]
}

mbtfm_study <- function(folder, table = "4_fit/tensions.csv", conditions = NULL, with_left_out = FALSE, program = "mbtfm") {
  cells <- mbtfm_cells(folder, program)
  cells$included <- cells$included == "TRUE"
  paths <- file.path(folder, cells$cell, table)
  there <- file.exists(paths)
  if (!any(there)) stop(folder, ": no cell has ", table, ": run mbtfm batch")
  cells$reason[cells$included & !there] <- paste(table, "is not there")
  for (i in which(!cells$included | !there)) message("left out: ", cells$cell[i], ": ", cells$reason[i])
  chosen <- which(there & (cells$included | with_left_out))
  frames <- lapply(chosen, function(i) {
    rows <- read.csv(paths[i])
    if ("fibre_id" %in% names(rows)) rows <- rows[!rows$fibre_id %in% strsplit(cells$fibres_left_out[i], ";")[[1]], ]
    cbind(cell = rep(cells$cell[i], nrow(rows)), rows, included = rep(cells$included[i], nrow(rows)), reason = rep(cells$reason[i], nrow(rows)))
  })
  columns <- Reduce(union, lapply(frames, names))
  frames <- lapply(frames, function(frame) {
    frame[setdiff(columns, names(frame))] <- NA
    frame[columns]
  })
  whole <- do.call(rbind, c(frames, make.row.names = FALSE))
  if (!is.null(conditions)) whole <- merge(whole, read.csv(conditions), by = "cell", all.x = TRUE)
  whole
}

# Tensions by type, and how they differ between conditions with the cell as the unit:
#
#   fibres <- subset(mbtfm_study("STUDY", conditions = "conditions.csv"), fibre_id > 0 & identifiable)
#   boxplot(tension_nN ~ type, fibres)
#   by_cell <- aggregate(tension_nN ~ cell + condition, subset(fibres, type == "ventral"), mean)
#   wilcox.test(tension_nN ~ condition, by_cell)
