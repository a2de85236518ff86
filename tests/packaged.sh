#!/usr/bin/env bash
# Installs, runs, removes and purges a Debian package in a root of its own: this machine's, seen through an overlay that
# keeps every change in memory. Run as `unshare --mount tests/packaged.sh PACKAGE FOLDER`, FOLDER empty.
set -euo pipefail
package=$1 folder=$2
mount -t tmpfs tmpfs "$folder"
mkdir "$folder/upper" "$folder/work" "$folder/root"
mount -t overlay overlay -o "lowerdir=/,upperdir=$folder/upper,workdir=$folder/work" "$folder/root"
mount --rbind /proc "$folder/root/proc"
mount --rbind /dev "$folder/root/dev"
mount -t tmpfs tmpfs "$folder/root/dev/shm"
chmod 1777 "$folder/root/dev/shm"
mkdir "$folder/root/package"
cp "$package" "$folder/root/package/truerate.deb"

chroot "$folder/root" sh -eu <<'IN'
export PATH=/usr/sbin:/usr/bin:/sbin:/bin
dpkg --force-unsafe-io --install /package/truerate.deb
getent passwd truerate
gzip -dc /usr/share/man/man1/truerate-diagnose.1.gz | grep -q 'truerate diagnose log.csv.gz'
bash -c '. /usr/share/bash-completion/completions/truerate; complete -p truerate'
install -d -o truerate -m 700 /var/lib/truerate /run/truerate
cd /var/lib/truerate
as() { runuser -u truerate -- env TRUERATE_RUNTIME_DIR=/run/truerate "$@"; }
as truerate simulate --hide delay:d=0.012 --seconds 20 --axis x -o log.csv.gz
as truerate diagnose log.csv.gz
as truerate run --config /etc/truerate.toml --source log.csv.gz --speed max --dashboard off
dpkg --force-unsafe-io --remove truerate
for gone in /usr/bin/truerate /usr/lib/systemd/system/truerate.service /usr/share/man/man1/truerate.1.gz; do
    test ! -e "$gone"
done
test -e /etc/truerate.toml && test -e /var/lib/truerate/log.csv.gz
dpkg --force-unsafe-io --purge truerate
test ! -e /etc/truerate.toml && test ! -e /var/lib/truerate
! getent passwd truerate
echo "all of it is gone"
IN
