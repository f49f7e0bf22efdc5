#!/bin/bash
# status.sh JOB: what has become of a job of Slurm, in Snakemake's words. The controller forgets a
# job some minutes after its end; then the accounting is asked, where there is one. Where neither
# answers, as when the controller starts anew, the job counts as running, and is asked for again.
job=$1
if said=$(scontrol --oneliner show job "$job" 2>&1); then
  state=$(grep -o 'JobState=[A-Z_]*' <<<"$said")
  state=${state#*=}
elif [[ $said == *"Invalid job id"* ]]; then
  state=$(sacct --noheader --allocations --format=State --jobs="$job" 2>/dev/null | awk '{ print $1 }')
  state=${state:-FORGOTTEN}
else
  state=RUNNING
fi
case $state in
  COMPLETED) echo success ;;
  PENDING | CONFIGURING | RUNNING | COMPLETING | SUSPENDED | STOPPED | REQUEUED | RESIZING) echo running ;;
  *) echo failed ;;
esac
