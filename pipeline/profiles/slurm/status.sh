#!/bin/sh
# What has become of a SLURM job, as Snakemake asks: running, success or failed. The controller knows jobs that ended
# some minutes ago at most, the accounting all, where there is one.
state=$(scontrol -o show job "$1" 2>/dev/null | sed -n 's/.*JobState=\([A-Z_]*\).*/\1/p')
[ -n "$state" ] || state=$(sacct -X -n -P -o State -j "$1" 2>/dev/null | head -n 1 | cut -d ' ' -f 1)
case "$state" in
  COMPLETED) echo success ;;
  BOOT_FAIL | CANCELLED* | DEADLINE | FAILED | NODE_FAIL | OUT_OF_MEMORY | PREEMPTED | REVOKED | TIMEOUT) echo failed ;;
  *) echo running ;; # pending, running, completing, or the controller does not answer just now
esac
