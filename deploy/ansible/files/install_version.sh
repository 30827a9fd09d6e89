#!/bin/sh
# Installs one version beside the others, without internet: install_version PYTHON ARCHIVE ID
# What fails half-way leaves nothing. Packages that two versions share are there once.
set -eu
umask 022
python=$1
archive=$2
id=$3
base=/opt/crcolony
version=$base/versions/$id
options="--no-index --no-deps --no-compile --no-cache-dir --quiet --root-user-action=ignore --disable-pip-version-check"
mkdir -p "$base/versions" "$base/packages"
scratch=$(mktemp -d "$base/install.XXXXXX")
trap 'rm -rf "$scratch" "$base"/packages/*.part; [ -e "$version/.complete" ] || rm -rf "$version"' EXIT

tar -xf "$archive" -C "$scratch"
cd "$scratch"
sha256sum --check --quiet SHA256SUMS
pip=$(echo "$scratch"/pip-*.whl)/pip
packages=$base/packages/$(grep -v '  crcolony-' SHA256SUMS | sha256sum | cut -c1-16)
if [ ! -e "$packages" ]; then
    for wheel in *.whl; do
        case $wheel in crcolony-* | pip-*) ;; *) echo "$scratch/$wheel" ;; esac
    done >"$scratch/wanted"
    "$python" "$pip" install $options --target "$packages.part" -r "$scratch/wanted"
    mv "$packages.part" "$packages"
fi

rm -rf "$version"
"$python" -m venv --without-pip "$version"
site=$("$version/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
echo "$packages" >"$site/packages.pth"
"$version/bin/python" "$pip" install $options "$scratch"/crcolony-*.whl
cp SHA256SUMS "$version/SHA256SUMS"
# Compiled code is cached by path and time of its source, and the path goes through `current`: a time that is a digest
# of the content keeps what has not changed over an upgrade, and nothing that has.
"$version/bin/python" - "$site" <<'END'
import hashlib
import os
import pathlib
import sys

for package in ("crcolony", "crcolony_bridge", "crcolony_dashboards", "crcolony_deploy"):
    for source in pathlib.Path(sys.argv[1], package).rglob("*.py"):
        stamp = int.from_bytes(hashlib.sha256(source.read_bytes()).digest()[:4], "big") // 2
        os.utime(source, (stamp, stamp))
END
PYTHONDONTWRITEBYTECODE=1 "$version/bin/python" -m crcolony --version
touch "$version/.complete"
