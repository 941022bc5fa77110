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
case $output in
*.exr | *.png | *.jpg | *.jpeg) ;;
*)
    echo "$output: the picture's name must end in .exr, .png or .jpg" >&2
    exit 2
    ;;
esac
shift 4
folder=${output%.*}.parts
mkdir -p "$folder"
seq "$parts" >"$folder/numbers"
parallel --sshlogin "$hosts" --jobs 1 --workdir . --retries 3 --joblog "$folder/jobs.log" \
    --results "$folder/{}.log" --quote --arg-file "$folder/numbers" \
    gdpt render "$scene" --part "{}/$parts" -o "$folder/part-{}.gdpt" --resume --quiet "$@" &
jobs=$!
# Told once it starts no more parts, told twice it ends those that run: they keep their films.
trap 'kill -TERM $jobs; sleep 1; kill -TERM $jobs; wait $jobs; exit 75' TERM INT
if ! wait $jobs; then
    cat "$folder"/*.log.err >&2
    echo "not all parts are done; the same command goes on from where they are" >&2
    exit 1
fi
gdpt merge "$folder"/part-*.gdpt -o "$output"
