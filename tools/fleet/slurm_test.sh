#!/bin/bash
# tools/fleet/slurm_test.sh [CAMGYRO]: runs the workflow of tools/fleet on a Slurm of this machine
# alone, started for it in a temporary folder (as root, without systemd and cgroups). While it runs,
# a worker of one device is killed and the job of another one is cancelled; then the files have to
# be those of one `camgyro batch`, byte for byte. Run it after a change to tools/fleet; CI does not,
# where tests/tools/fleet_test.py runs the same workflow without Slurm.
set -euo pipefail
cd "$(dirname "$0")/../.."
camgyro=$(realpath "${1:-build/release/tools/camgyro}")
tools/install_deps.sh snakemake slurm-wlm munge procps

work=$(mktemp -d)
export SLURM_CONF=$work/slurm.conf HOME=$work
daemons=()
stop() {
  scancel --user="$(id -un)" 2>/dev/null || true
  (( ${#daemons[@]} == 0 )) || kill "${daemons[@]}" 2>/dev/null || true
  wait
  rm -rf "$work"
}
trap stop EXIT
# A daemon's words, if something did not come; and what was to come.
fail() { echo "$*" >&2; tail -n 20 "$work"/*.log >&2; exit 1; }
wait_for() {  # COMMAND...: for a minute
  local try
  for ((try = 0; try < 600; ++try)); do if "$@"; then return; fi; sleep 0.1; done
  fail "in vain: $*"
}

port() { python3 -c 'import socket; s = socket.socket(); s.bind(("", 0)); print(s.getsockname()[1])'; }
mkdir -m 700 "$work/state" "$work/munge" "$work/spool"
head -c 128 /dev/urandom >"$work/munge/key"
chmod 600 "$work/munge/key"
cat >"$SLURM_CONF" <<EOF
ClusterName=test
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmUser=$(id -un)
SlurmctldPort=$(port)
SlurmdPort=$(port)
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
ReturnToService=2
NodeName=$(hostname -s) NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$(awk '/MemTotal/ { print int($2 / 1024) }' /proc/meminfo)
PartitionName=test Nodes=ALL Default=YES
EOF

munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" \
  --pid-file="$work/munge/pid" --seed-file="$work/munge/seed" 2>"$work/munged.log" &
daemons+=($!)
wait_for test -S "$work/munge/socket"
slurmctld -D -L "$work/slurmctld.log" 2>/dev/null &
daemons+=($!)
slurmd -D -L "$work/slurmd.log" 2>/dev/null &
daemons+=($!)
idle() { [[ $(sinfo --noheader --format=%t 2>/dev/null) == idle ]]; }
wait_for idle

# Two recordings of each of three devices, long enough to be met at work.
manifest=$work/list.csv
echo device,recording >"$manifest"
for number in 1 2 3 4 5 6; do
  "$camgyro" simulate tools/scenarios/motion_walking.yaml seed=$number duration_s=10 \
    --out "$work/r$number" >/dev/null
  echo "device$((number % 3)),r$number" >>"$manifest"
done
"$camgyro" batch "$manifest" --out="$work/plain" --quiet >/dev/null

# Says who works on a device, and in which job.
cat >"$work/camgyro.sh" <<EOF
#!/bin/bash
for last; do :; done
echo "\$\$ \$SLURM_JOB_ID" >>"$work/started\${last#--only}"
exec "$camgyro" "\$@"
EOF
chmod +x "$work/camgyro.sh"

snakemake -s tools/fleet/Snakefile -d "$work" --profile "$PWD/tools/fleet/slurm" --latency-wait 10 \
  --config manifest="$manifest" out="$work/out" camgyro="$work/camgyro.sh" mem_mb=300 \
  >"$work/snakemake.log" 2>&1 &
workflow=$!
worker() { pgrep -P "$batch" >"$work/worker"; }  # what batch has forked
wait_for test -s "$work/started=device0"
read -r batch job <"$work/started=device0"
wait_for worker
kill -9 "$(cat "$work/worker")"
echo "killed a worker of device0 (job $job)"
wait_for test -s "$work/started=device1"
read -r batch job <"$work/started=device1"
scancel "$job"
echo "cancelled the job of device1 (job $job)"
wait "$workflow" || fail "the workflow failed"

for device in device0 device1; do
  (( $(wc -l <"$work/started=$device") > 1 )) || fail "$device was not started again"
done
# Of one run: its times, its words, and the devices' own tables of recordings.
diff -r -x outcome.yaml -x log.txt -x batch.log -x '*.html' -x recordings.csv "$work/plain" "$work/out"
diff "$work/plain/recordings.csv" "$work/out/recordings.csv"
echo "as one batch: $(wc -l <"$work/out/recordings.csv") rows in recordings.csv," \
  "$(find "$work/out" -name calibration.yaml | wc -l) calibrations"
