# The study as one tidy frame in R, without packages: source("study.R"); fibres <- mbtfm_study("STUDY")
#
# A row for each fibre of each cell: columns of tensions.csv (docs/columns.md) and `cell`, the path below the folder.
mbtfm_study <- function(folder, table = "4_fit/tensions.csv", conditions = NULL) {
  tomls <- list.files(folder, pattern = "^cell\\.toml$", recursive = TRUE)
  cells <- sort(dirname(tomls))
  files <- file.path(folder, cells, table)
  there <- file.exists(files)
  if (!any(there)) stop(folder, ": no cell has ", table, ": run mbtfm batch")
  if (!all(there)) message("left out, as they have no ", table, ": ", paste(cells[!there], collapse = ", "))
  frames <- Map(function(file, cell) cbind(cell = cell, read.csv(file)), files[there], cells[there])
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
