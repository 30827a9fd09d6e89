#!/bin/sh
# The first process of a machine of a test, in namespaces of its own: it mounts a root and becomes the machine's systemd.
# $1: folder of the machine (upper, work, root); $2: how cgroups are mounted here, as "TYPE:OPTIONS:FOLDER" words
set -eu
folder=$1
cgroups=$2
root=$folder/root
mount --make-rprivate /
mount -t overlay overlay -o "lowerdir=/,upperdir=$folder/upper,workdir=$folder/work,index=off,xino=off" "$root"

if [ ! -e "$root/etc/made-for-a-test" ]; then # its first boot: what this system starts by itself is not wanted there
    rm -rf "$root"/etc/systemd/system "$root"/etc/systemd/network "$root"/etc/ssh "$root"/var/log/journal
    rm -rf "$root"/var/lib/crcolony "$root"/opt/crcolony "$root"/etc/crcolony "$root"/etc/machine-id
    cp -a "$folder/etc/." "$root/etc/"
    mkdir -p "$root/etc/systemd/system/multi-user.target.wants" "$root/var/log/journal"
    ln -s /lib/systemd/system/ssh.service "$root/etc/systemd/system/multi-user.target.wants/"
    for unit in getty.target systemd-udevd.service systemd-udev-trigger.service systemd-timesyncd.service \
        systemd-networkd.service systemd-resolved.service e2scrub_reap.service apt-daily.timer; do
        ln -s /dev/null "$root/etc/systemd/system/$unit"
    done
    systemd-machine-id-setup --root="$root" >/dev/null 2>&1
    touch "$root/etc/made-for-a-test"
fi

mount -t proc proc "$root/proc"
mount -t sysfs sysfs "$root/sys"
mount -t tmpfs -o mode=755 tmpfs "$root/sys/fs/cgroup"
for one in $cgroups; do
    type=${one%%:*}
    rest=${one#*:}
    options=${rest%%:*}
    at=$root/sys/fs/cgroup/${rest#*:}
    mkdir -p "$at"
    mount -t "$type" -o "$options" cgroup "$at"
done
mount -t tmpfs -o mode=755 tmpfs "$root/run"
mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
mount -t tmpfs -o mode=755 tmpfs "$root/dev"
mkdir "$root/dev/pts" "$root/dev/shm"
mount -t devpts -o newinstance,ptmxmode=666,mode=620,gid=5 devpts "$root/dev/pts"
mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm"
for device in "null 1 3" "zero 1 5" "full 1 7" "random 1 8" "urandom 1 9" "tty 5 0"; do
    set -- $device
    mknod -m 666 "$root/dev/$1" c "$2" "$3"
done
ln -s pts/ptmx "$root/dev/ptmx"
ln -s /proc/self/fd "$root/dev/fd"
for number in 0 1 2; do ln -s "/proc/self/fd/$number" "$root/dev/$(echo stdin stdout stderr | cut -d' ' -f$((number + 1)))"; done
cd "$root"
# Not a chroot: in one the kernel makes no user namespaces, which services have (PrivateUsers=).
pivot_root . .
umount -l .
exec env -i container=crcolony PATH=/usr/sbin:/usr/bin:/sbin:/bin \
    /lib/systemd/systemd --system --unit=multi-user.target --show-status=no --log-target=console
