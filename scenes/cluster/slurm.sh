#!/bin/sh
# Renders a scene on a Slurm cluster: one job array of parts, and a job that merges them once all are done.
#
#   slurm.sh SCENE.obj OUT.exr PARTS [FLAGS of gdpt render]
#   slurm.sh scenes/still.obj still.exr 16 --spp 4096
#
# For parts of a time of their own: --time 2h in place of --spp. What sbatch is to know besides (partition, memory,
# time limit) goes into SBATCH_PARTITION, SBATCH_MEM_PER_NODE, SBATCH_TIMELIMIT, or into part.slurm. Of more than a
# thousand parts the cluster's MaxArraySize must allow it.
set -eu
if [ $# -lt 3 ]; then
    sed -n 's/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
scene=$1 output=$2 parts=$3
case $output in
*.exr | *.png | *.jpg | *.jpeg) ;;
*)
    echo "$output: the picture's name must end in .exr, .png or .jpg" >&2
    exit 2
    ;;
esac
shift 3
folder=${output%.*}.parts
mkdir -p "$folder"
array=$(sbatch --parsable --array="1-$parts" --output="$folder/%a.log" "$here/part.slurm" "$scene" "$folder" "$@")
merge=$(sbatch --parsable --dependency="afterok:$array" --kill-on-invalid-dep=yes --output="$folder/merge.log" "$here/merge.slurm" "$folder" "$output")
echo "parts: job $array, merge: job $merge, logs and films: $folder"
