# Holds the hierarchy of `truerate fleet` against metafor, on the same readings:
#
#     Rscript tests/peers/fleet.R FLEET.json
#
# FLEET.json is what `truerate fleet F --format json` prints. It needs the packages r-cran-metafor and r-cran-jsonlite.
# Every type and parameter of three parts or more is fitted with metafor (REML; `test="adhoc"` is Knapp and Hartung's error, not below the plain
# one), and as a nested model where parts have several logs. lme4 knows no errors that are given and differ from reading to reading: its
# numbers stand in gyro-model/src/pooled/spread/tests.rs.
suppressPackageStartupMessages({
  library(metafor)
  library(jsonlite)
})
fleet <- fromJSON(commandArgs(TRUE)[1], simplifyVector = FALSE)
wrong <- 0
apart <- function(what, own, theirs, scale, tolerance) {
  off <- abs(own - theirs) / scale
  cat(sprintf("  %-16s %-18.10g %-18.10g %8.1e\n", what, own, theirs, off))
  if (!is.finite(off) || off > tolerance) {
    cat("  ^ differs\n")
    wrong <<- wrong + 1
  }
}
held <- 0
for (row in fleet$types) {
  told <- Filter(function(r) !r$outlier, row$readings)
  y <- vapply(told, function(r) r$value, 0)
  v <- vapply(told, function(r) r$std_error, 0)^2
  part <- factor(vapply(told, function(r) r$part, ""))
  if (nlevels(part) < 3) next
  held <- held + 1
  # metafor's optimisers stop at absolute steps: in units of a typical error nothing is small.
  unit <- sqrt(median(v))
  about <- mean(y)
  y <- (y - about) / unit
  v <- v / unit^2
  nested <- length(y) > nlevels(part)
  cat(sprintf("%s %s.%s, axis %s: %d logs of %d parts\n", row$type, row$effect, row$name, row$axis, length(y), nlevels(part)))
  cat("                   here               metafor            off\n")
  own <- function(x) (x - about) / unit
  if (nested) {
    log <- factor(seq_along(y))
    fit <- rma.mv(y, v, random = ~ 1 | part / log, method = "REML", control = list(optimizer = "optim", optmethod = "BFGS", reltol = 1e-15))
    # The likelihood is flat at its top: an optimum is known to some 1e-6 of the scatter, a spread at zero to the root of that.
    apart("mean", own(row$mean), as.numeric(coef(fit)), 1, 1e-5)
    apart("between parts", row$spread / unit, sqrt(fit$sigma2[1]), 1, 1e-3)
    apart("between logs", row$spread_of_logs / unit, sqrt(fit$sigma2[2]), 1, 1e-3)
  } else {
    # Where no spread is found, metafor says the same with both errors; a threshold of 1e-14 finds the spread to more digits than are held.
    fit <- rma(y, v, method = "REML", test = "adhoc", control = list(threshold = 1e-14, maxiter = 10000, stepadj = 0.5))
    next_part <- predict(fit)
    apart("mean", own(row$mean), as.numeric(coef(fit)), 1, 1e-6)
    apart("std_error", row$std_error / unit, fit$se, fit$se, 1e-6)
    apart("between parts", row$spread / unit, sqrt(fit$tau2), max(sqrt(fit$tau2), 1e-3), 1e-6)
    apart("next, from", own(row$`next`[[1]]), next_part$pi.lb, 1, 1e-5)
    apart("next, to", own(row$`next`[[2]]), next_part$pi.ub, 1, 1e-5)
  }
}
if (held == 0) stop("no parameter of three parts or more in this file")
cat(sprintf("%d parameters held, %d numbers differ\n", held, wrong))
quit(status = if (wrong > 0) 1 else 0)
