# Makes the tables that tests/analytic/statistics.cpp reads: fibres.csv, cells.csv (a drawn study) and expected.csv, what
# R's own functions say of them. Run in this folder: Rscript expected.R
# Debian packages: r-base-core r-cran-nlme r-cran-lme4 r-cran-lmertest r-cran-metafor
suppressMessages({library(nlme); library(lmerTest); library(metafor)})
set.seed(20)
draw <- function(n_cells) {
  rows <- NULL
  for (cell in 1:n_cells) {
    own <- rnorm(1, 0, 0.6)
    for (type in c("dorsal", "arc", "ventral")) {
      n <- sample(0:7, 1)
      if (n == 0) next
      of_type <- rnorm(1, 0, 0.4)
      mean <- c(dorsal = 2, arc = 2.6, ventral = 4)[[type]] + own + of_type + (cell %% 2) * 0.3
      sigma <- round(runif(n, 0.1, 1.2), 3)
      spread <- c(dorsal = 0.5, arc = 0.8, ventral = 1.6)[[type]]
      rows <- rbind(rows, data.frame(cell = cell, condition = c("control", "treated")[1 + cell %% 2], type = type,
                                     tension_nN = round(mean + rnorm(n, 0, spread) + rnorm(n, 0, sigma), 2),
                                     sigma_nN = sigma))
    }
  }
  rows
}
fibres <- draw(16)
write.csv(fibres, "fibres.csv", row.names = FALSE, quote = FALSE)
fibres <- read.csv("fibres.csv")
cells <- data.frame(cell = 1:14, n_adhesions = round(runif(14, 60, 220)))
cells$total_force_nN <- round(0.8 * cells$n_adhesions * exp(rnorm(14, 0, 0.25)), 1)
write.csv(cells, "cells.csv", row.names = FALSE, quote = FALSE)
cells <- read.csv("cells.csv")

expected <- data.frame(name = character(), value = numeric())
say <- function(name, value) expected[nrow(expected) + 1, ] <<- list(name, as.numeric(value))
types <- c("dorsal", "arc", "ventral")
fibres$type <- factor(fibres$type, levels = types)
fibres$cell <- factor(fibres$cell)
y <- split(fibres$tension_nN, fibres$type)

# ranks
h <- kruskal.test(tension_nN ~ type, fibres)
say("kruskal.h", h$statistic); say("kruskal.p", h$p.value)
pairs <- list(c("dorsal", "arc"), c("dorsal", "ventral"), c("arc", "ventral"))
p <- NULL
for (pair in pairs) {
  u <- wilcox.test(y[[pair[1]]], y[[pair[2]]], exact = FALSE, correct = TRUE)
  name <- paste0("wilcoxon.", pair[1], ".", pair[2])
  say(paste0(name, ".u"), u$statistic); say(paste0(name, ".p"), u$p.value)
  p <- c(p, u$p.value)
}
for (i in 1:3) say(paste0("holm.", i), p.adjust(p, "holm")[i])

# shares and lines
above <- sum(y$ventral > 5)
wilson <- prop.test(above, length(y$ventral), correct = FALSE)$conf.int
say("wilson.low", wilson[1]); say("wilson.high", wilson[2])
line <- summary(lm(total_force_nN ~ 0 + n_adhesions, cells))
say("line.slope", line$coefficients[1, 1]); say("line.error", line$coefficients[1, 2])
say("line.r", cor(cells$n_adhesions, cells$total_force_nN))

# mixed models
model <- lmer(tension_nN ~ 0 + type + (1 | cell), fibres)
say("lmer.log_likelihood", logLik(model))
say("lmer.cell_variance", as.data.frame(VarCorr(model))$vcov[1])
say("lmer.residual_variance", as.data.frame(VarCorr(model))$vcov[2])
for (i in 1:3) {
  s <- coef(summary(model))[i, ]
  say(paste0("lmer.mean.", types[i]), s[1]); say(paste0("lmer.error.", types[i]), s[2])
  say(paste0("lmer.degrees.", types[i]), s[3])
}
difference <- contest1D(model, c(-1, 0, 1))
say("lmer.ventral_dorsal.estimate", difference[["Estimate"]]); say("lmer.ventral_dorsal.error", difference[["Std. Error"]])
say("lmer.ventral_dorsal.degrees", difference[["df"]]); say("lmer.ventral_dorsal.p", difference[["Pr(>|t|)"]])
all <- contestMD(model, rbind(c(-1, 1, 0), c(-1, 0, 1)))
say("lmer.all.f", all[["F value"]]); say("lmer.all.degrees", all[["DenDF"]]); say("lmer.all.p", all[["Pr(>F)"]])

nested <- lme(tension_nN ~ 0 + type, random = ~ 1 | cell/type, weights = varIdent(form = ~ 1 | type), data = fibres,
              control = lmeControl(opt = "optim", tolerance = 1e-10, msTol = 1e-12))
say("lme.log_likelihood", logLik(nested))
variances <- as.numeric(VarCorr(nested)[c(2, 4), "Variance"])
say("lme.cell_variance", variances[1]); say("lme.cell_kind_variance", variances[2])
scale <- coef(nested$modelStruct$varStruct, unconstrained = FALSE, allCoef = TRUE)[types]
for (i in 1:3) {
  say(paste0("lme.mean.", types[i]), fixef(nested)[i]); say(paste0("lme.error.", types[i]), sqrt(vcov(nested)[i, i]))
  say(paste0("lme.residual_variance.", types[i]), (nested$sigma * scale[[i]])^2)
}

# with the known error variance of each fibre
fibres$id <- seq_len(nrow(fibres)); fibres$own <- interaction(fibres$cell, fibres$type)
known <- rma.mv(tension_nN, sigma_nN^2, mods = ~ 0 + type, random = list(~ 1 | cell, ~ 1 | own, ~ type | id),
                struct = "DIAG", data = fibres, method = "REML", control = list(optimizer = "optim", reltol = 1e-14))
# metafor adds log|X'X| / 2, which does not depend on the parameters
say("rma.log_likelihood", logLik(known) - sum(log(table(fibres$type))) / 2)
say("rma.cell_variance", known$sigma2[1]); say("rma.cell_kind_variance", known$sigma2[2])
for (i in 1:3) {
  say(paste0("rma.mean.", types[i]), known$beta[i]); say(paste0("rma.error.", types[i]), known$se[i])
  say(paste0("rma.residual_variance.", types[i]), known$tau2[i])
}

# The clustered rank-sum test, by its definition: the rank sum over all ways to draw one fibre from each cell, here its
# mean (Datta & Satten 2005, eq. 2), for ventral against dorsal fibres, over the scatter of the cells' contributions
# (eq. 5); no package of Debian has it. Of two groups Hotelling's T² is F.
two <- subset(fibres, type != "arc"); two$cell <- factor(as.character(two$cell))
share <- function(values, x) (mean(values <= x) + mean(values < x)) / 2
M <- nlevels(two$cell); s <- 0; mean_s <- 0; w <- c()
ventral <- sapply(levels(two$cell), function(i) mean(two$type[two$cell == i] == "ventral"))
for (i in levels(two$cell)) {
  here <- two[two$cell == i, ]; others <- setdiff(levels(two$cell), i); w_i <- -M / (M + 1) * (ventral[i] - mean(ventral)) / 2
  for (k in seq_len(nrow(here))) {
    is_ventral <- here$type[k] == "ventral"
    shares <- sapply(levels(two$cell), function(j) share(two$tension_nN[two$cell == j], here$tension_nN[k]))
    if (is_ventral) s <- s + (1 + sum(shares[others])) / nrow(here) / (M + 1)
    w_i <- w_i + ((M - 1) * is_ventral - sum(ventral[others])) * mean(shares) / nrow(here) / (M + 1)
  }
  w <- c(w, w_i); mean_s <- mean_s + ventral[i] / 2
}
say("clustered.f", (s - mean_s)^2 / (M * var(w)))

expected$value <- signif(expected$value, 10)
write.csv(expected, "expected.csv", row.names = FALSE, quote = FALSE)
