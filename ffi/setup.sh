#!/bin/sh
# Installs what building gdpt needs beside cargo: a C compiler, libclang (for bindgen) and Embree 4.
#
# Embree 4 comes from the distribution's libembree-dev where that is version 4 (Debian 13, Ubuntu 24.04).
# Elsewhere (Debian 12) the library is taken from a pinned PyPI wheel and the headers from Debian 13's
# libembree-dev package; both go into one private prefix. Package sources stay as they are and nothing
# else on the machine is upgraded. Safe to run again: quiet when there is nothing to do.
#
# --denoiser        install Open Image Denoise 2 too, which gdpt looks for when it is to denoise: from a pinned
#                   PyPI wheel, what the CPU needs of it, into ~/.local/share/gdpt/oidn
#
# EMBREE_ROOT=DIR   use (or make) the prefix DIR instead of ~/.local/share/gdpt/embree4
set -eu

DENOISER=no
for argument in "$@"; do
    case $argument in
        --denoiser) DENOISER=yes ;;
        *) echo "setup: knows --denoiser alone, not $argument" >&2; exit 2 ;;
    esac
done

PREFIX=${EMBREE_ROOT:-${XDG_DATA_HOME:-$HOME/.local/share}/gdpt/embree4}
WHEEL_VERSION=4.4.0.post1
WHEEL_SHA256=2cd0f7d5c6342e6247e31f700761689cae7829454d8c6de0c41e62124a023e1f
OIDN=${XDG_DATA_HOME:-$HOME/.local/share}/gdpt/oidn
OIDN_VERSION=2.5.1
OIDN_WHEEL_SHA256=32ad13368f8de1ef63001942ad05b02a00cd732d1206d97f352d3a3f606d823e

say() { echo "setup: $*"; }
fail() { echo "setup: $*" >&2; exit 1; }
have() { command -v "$1" >/dev/null 2>&1; }

# --- root, or how to become root -------------------------------------------------------------------
as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif have sudo && sudo -n true 2>/dev/null; then
        sudo "$@"
    else
        fail "may not install packages here. Run this as root, then start ffi/setup.sh again:
    $*"
    fi
}

# apt_install PACKAGE...: installs those packages that are missing, upgrades none that are there.
lists_fresh=no
apt_install() {
    missing=
    for package in "$@"; do
        dpkg-query -W -f '${Status}\n' "$package" 2>/dev/null | grep -q '^install ok installed' || missing="$missing $package"
    done
    [ -n "$missing" ] || return 0
    if [ $lists_fresh = no ]; then
        say "reading the package lists"
        as_root apt-get update -qq || say "the package lists could not be renewed; trying with those that are there"
        lists_fresh=yes
    fi
    say "installing$missing"
    # shellcheck disable=SC2086  # the list is meant to be split
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends --no-upgrade $missing >"$LOG" 2>&1 ||
        { tail -n 15 "$LOG" >&2; fail "apt-get could not install$missing"; }
}

# fetch_wheel PACKAGE==VERSION SHA256 PLATFORM: into $WORK
fetch_wheel() {
    have python3 && python3 -m pip --version >/dev/null 2>&1 || apt_install python3 python3-pip ca-certificates
    echo "$1 --hash=sha256:$2" >"$WORK/requirements.txt"
    python3 -m pip download -q --no-deps --require-hashes --only-binary=:all: --dest "$WORK" \
        --platform "$3" --implementation cp --python-version 3.11 \
        -r "$WORK/requirements.txt" >"$LOG" 2>&1 || { tail -n 5 "$LOG" >&2; fail "the wheel could not be fetched"; }
}

any_exists() { for path in "$@"; do [ ! -e "$path" ] || return 0; done; return 1; }

# --- what is there already -------------------------------------------------------------------------
embree_in() { # embree_in PREFIX: is there an Embree 4 with packets and instPrimID (4.3 or later)?
    config=$1/include/embree4/rtcore_config.h
    [ -f "$config" ] || return 1
    major=$(sed -n 's/^#define RTC_VERSION_MAJOR \([0-9]*\).*/\1/p' "$config")
    minor=$(sed -n 's/^#define RTC_VERSION_MINOR \([0-9]*\).*/\1/p' "$config")
    [ "${major:-0}" -eq 4 ] && [ "${minor:-0}" -ge 3 ] || return 1
    any_exists "$1"/lib/libembree4.so "$1"/lib64/libembree4.so "$1"/lib/*/libembree4.so
}
libclang_found() {
    [ -n "${LIBCLANG_PATH:-}" ] && return 0
    any_exists /usr/lib/llvm-*/lib/libclang.so* /usr/lib/*/libclang.so* /usr/lib/*/libclang-*.so* \
        /usr/lib64/libclang.so* /usr/lib/libclang.so* /usr/local/lib/libclang.so*
}
clang_headers_found() { any_exists /usr/lib/llvm-*/lib/clang/*/include /usr/lib/clang/*/include; }

[ "$(uname -s)" = Linux ] || fail "knows Linux only. Install Embree 4.3 or later, set EMBREE_ROOT to its prefix, and build with cargo."

WORK=$(mktemp -d)
trap 'rm -rf "$WORK"' EXIT
trap 'exit 1' HUP INT TERM
LOG=$WORK/log

# --- Open Image Denoise ----------------------------------------------------------------------------
if [ $DENOISER = yes ] && [ ! -f "$OIDN/lib/libOpenImageDenoise.so.2" ]; then
    [ "$(uname -m)" = x86_64 ] || fail "no ready-made Open Image Denoise for $(uname -m). Install it, and set GDPT_OIDN to its library."
    say "fetching Open Image Denoise (PyPI wheel pyoidn $OIDN_VERSION.0, 84 MB)"
    fetch_wheel "pyoidn==$OIDN_VERSION.0" $OIDN_WHEEL_SHA256 manylinux2014_x86_64
    say "unpacking into $OIDN"
    mkdir -p "$(dirname "$OIDN")"
    NEW=$(mktemp -d "$(dirname "$OIDN")/.oidn.XXXXXX")
    trap 'rm -rf "$WORK" "$NEW"' EXIT
    mkdir "$NEW/lib"
    python3 -m zipfile -e "$WORK"/pyoidn-*.whl "$WORK/oidn"
    for library in OpenImageDenoise.so.2 OpenImageDenoise_core.so.$OIDN_VERSION OpenImageDenoise_device_cpu.so.$OIDN_VERSION tbb.so.12; do
        mv "$WORK/oidn/pyoidn/oidn/lib/lib$library" "$NEW/lib/"
    done
    mv "$WORK"/oidn/pyoidn-*.dist-info/licenses/LICENSE "$NEW/"
    chmod 755 "$NEW" "$NEW"/lib/*
    # Another setup may have been faster.
    [ -d "$OIDN" ] || mv "$NEW" "$OIDN"
    rm -rf "$NEW"
    [ -f "$OIDN/lib/libOpenImageDenoise.so.2" ] || fail "$OIDN is there but holds no Open Image Denoise; move it away and start again"
    say "Open Image Denoise is in $OIDN"
fi

# --- compiler and libclang -------------------------------------------------------------------------
need=
have cc || need="$need gcc libc6-dev"
{ libclang_found && clang_headers_found; } || need="$need libclang-dev"
if [ -n "$need" ]; then
    have apt-get || fail "needs these, and knows only apt to install them: a C compiler, libclang with its headers."
    # shellcheck disable=SC2086
    apt_install $need
fi

# --- Embree 4 --------------------------------------------------------------------------------------
if embree_in "$PREFIX" || { [ -z "${EMBREE_ROOT:-}" ] && { embree_in /usr || embree_in /usr/local; }; }; then
    exit 0
fi
have apt-get || fail "no Embree 4.3 or later found. Install it and set EMBREE_ROOT to its prefix."
candidate() { apt-cache policy libembree-dev 2>/dev/null | sed -n 's/ *Candidate: //p'; }
case $(candidate) in
    ''|'(none)')
        say "reading the package lists"
        as_root apt-get update -qq && lists_fresh=yes ;;
esac
case $(candidate) in
    4.[3-9]*|4.[1-9][0-9]*)
        if [ -z "${EMBREE_ROOT:-}" ]; then apt_install libembree-dev; exit 0; fi ;;
esac

# The private prefix. Everything below is unpacked beside the prefix and moved into place at the end.
[ "$(uname -m)" = x86_64 ] || fail "no ready-made Embree 4 for $(uname -m) on this distribution. Build it, and set EMBREE_ROOT to its prefix."
say "fetching the Embree 4 library (PyPI wheel embreex $WHEEL_VERSION)"
fetch_wheel "embreex==$WHEEL_VERSION" $WHEEL_SHA256 manylinux_2_28_x86_64

say "fetching the Embree 4 headers (Debian 13's libembree-dev)"
site=$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' | grep -v security | head -n 1)
[ -n "$site" ] || fail "apt names no package site to take the headers from"
keyring=/usr/share/keyrings/debian-archive-keyring.gpg
[ -f $keyring ] && signed="[signed-by=$keyring]" || signed=
echo "deb $signed $site trixie main" >"$WORK/sources.list"
mkdir -p "$WORK/lists/partial" "$WORK/cache/archives/partial"
chmod 755 "$WORK"
apt_private() {
    apt-get -qq -o Dir::Etc::sourcelist="$WORK/sources.list" -o Dir::Etc::sourceparts=- \
        -o Dir::State::Lists="$WORK/lists" -o Dir::Cache="$WORK/cache" -o APT::Sandbox::User= \
        -o Acquire::IndexTargets::deb::DEP-11::DefaultEnabled=false \
        -o Acquire::Languages=none -o Debug::NoLocking=1 "$@"
}
apt_private update >"$LOG" 2>&1 || { tail -n 5 "$LOG" >&2; fail "Debian 13's package list could not be read from $site"; }
(cd "$WORK" && apt_private download libembree-dev) >"$LOG" 2>&1 || { tail -n 5 "$LOG" >&2; fail "Debian 13's libembree-dev could not be fetched"; }

say "unpacking into $PREFIX"
mkdir -p "$(dirname "$PREFIX")"
NEW=$(mktemp -d "$(dirname "$PREFIX")/.embree4.XXXXXX")
trap 'rm -rf "$WORK" "$NEW"' EXIT
mkdir "$NEW/lib" "$NEW/include"
dpkg-deb -x "$WORK"/libembree-dev_*.deb "$WORK/headers"
mv "$WORK/headers/usr/include/embree4" "$NEW/include/"
python3 -m zipfile -e "$WORK"/embreex-*.whl "$WORK/wheel"
mv "$WORK"/wheel/embreex.libs/lib* "$NEW/lib/"
chmod 755 "$NEW" "$NEW"/lib/*
(cd "$NEW/lib" && ln -s libembree4-*.so.4 libembree4.so)
if [ -d "$PREFIX" ]; then
    embree_in "$PREFIX" && exit 0 # another setup was faster
    fail "$PREFIX is there but holds no Embree 4.3 or later; move it away and start again"
fi
mv "$NEW" "$PREFIX"
embree_in "$PREFIX" || fail "the prefix $PREFIX came out incomplete"
say "Embree 4 is in $PREFIX"
