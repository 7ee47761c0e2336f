# start_slurm FOLDER: munge, a controller and one node, all of this machine and all of their files in FOLDER, on ports of
# their own. Sets SLURM_CONF and adds to the array `pids`. As root.
start_slurm() {
  local folder=$1 name
  name=$(hostname -s)
  mkdir -p "$folder/state" "$folder/spool" "$folder/munge"
  chmod 755 "$work" "$folder" # munge refuses folders that others may write to
  chmod 711 "$folder/munge"
  head -c 128 /dev/urandom >"$folder/munge.key"
  chmod 400 "$folder/munge.key"
  munged --foreground --force --socket "$folder/munge/socket" --key-file "$folder/munge.key" \
    --pid-file "$folder/munge/pid" --seed-file "$folder/munge/seed" --log-file "$folder/munge/log" \
    >"$folder/munged.out" 2>&1 &
  pids+=($!)
  cat >"$folder/slurm.conf" <<CONF
ClusterName=mbtfm
SlurmctldHost=$name(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket
CredType=cred/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
MpiDefault=none
SwitchType=switch/none
ReturnToService=2
SlurmdParameters=config_overrides
NodeName=$name NodeAddr=127.0.0.1 CPUs=2 RealMemory=1500 State=UNKNOWN
PartitionName=all Nodes=$name Default=YES MaxTime=INFINITE State=UP
CONF
  export SLURM_CONF=$folder/slurm.conf
  for _ in $(seq 50); do [ -S "$folder/munge/socket" ] && break || sleep 0.2; done
  slurmctld -D -f "$SLURM_CONF" >"$folder/slurmctld.out" 2>&1 &
  pids+=($!)
  slurmd -D -f "$SLURM_CONF" -N "$name" >"$folder/slurmd.out" 2>&1 &
  pids+=($!)
  for _ in $(seq 100); do
    sinfo -h -o %t 2>/dev/null | grep -q idle && return
    sleep 0.3
  done
  tail -n 20 "$folder"/*.out >&2
  fail "SLURM did not come up"
}
