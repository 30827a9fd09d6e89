#!/bin/sh
# Installs one version beside the others, without internet: install_version PYTHON ID PACKAGES
# The archives lie in /opt/crcolony. What fails half-way leaves nothing. Packages that two versions share are there once.
set -eu
umask 022
python=$1
id=$2
base=/opt/crcolony
version=$base/versions/$id
packages=$base/packages/$3
options="--no-index --no-deps --no-compile --no-cache-dir --quiet --root-user-action=ignore --disable-pip-version-check"
mkdir -p "$base/versions" "$base/packages" /etc/crcolony /var/lib/crcolony
install -d -o crcolony -g crcolony -m 750 /var/cache/crcolony
scratch=$(mktemp -d "$base/install.XXXXXX")
trap 'rm -rf "$scratch" "$packages.part"; [ -e "$version/.complete" ] || rm -rf "$version"' EXIT

cd "$scratch"
tar -xf "$base"/crcolony-*.tar
sha256sum --check --quiet SHA256SUMS
pip=$(echo "$scratch"/pip-*.whl)/pip
if [ ! -e "$packages" ]; then
    mkdir packages
    tar -xf "$base"/packages-*.tar -C packages
    (cd packages && sha256sum --check --quiet SHA256SUMS)
    "$python" "$pip" install $options --target "$packages.part" packages/*.whl
    cp packages/SHA256SUMS "$packages.part/"
    mv "$packages.part" "$packages"
fi

rm -rf "$version"
"$python" -m venv --without-pip "$version"
site=$("$version/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
echo "$packages" >"$site/packages.pth"
"$version/bin/python" "$pip" install $options "$scratch"/crcolony-*.whl
cat "$packages/SHA256SUMS" SHA256SUMS >"$version/SHA256SUMS"
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
