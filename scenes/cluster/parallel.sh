#!/bin/sh
# Renders a scene on several hosts by GNU parallel, a part at a time on each, and merges the parts here.
#
#   parallel.sh HOSTS SCENE.obj OUT.exr PARTS [FLAGS of gdpt render]
#   parallel.sh node1,node2,node3 scenes/still.obj still.exr 16 --spp 4096
#
# HOSTS is what parallel takes after --sshlogin; `:` is this machine. Scene and gdpt must be at the same places on all of
# them, and the current folder shared. A part that fails is tried again, where parallel sees fit, and goes on from where
# its film is; the same command once more renders only what is missing.
set -eu
if [ $# -lt 4 ]; then
    sed -n 's/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
hosts=$1 scene=$2 output=$3 parts=$4
shift 4
folder=${output%.*}.parts
mkdir -p "$folder"
seq "$parts" | parallel --sshlogin "$hosts" --jobs 1 --workdir . --retries 3 --joblog "$folder/jobs.log" \
    --results "$folder/{}.log" --quote \
    gdpt render "$scene" --part "{}/$parts" -o "$folder/part-{}.gdpt" --resume --quiet "$@"
gdpt merge "$folder"/part-*.gdpt -o "$output"
