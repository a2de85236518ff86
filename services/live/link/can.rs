//! A CAN interface of Linux, `can0` or `vcan0`: each frame as the line that `candump` would write of it, with the kernel's time.

use super::{Got, Link, has_come};
use std::{
    fmt::Write as _,
    io,
    os::fd::{AsRawFd, FromRawFd, OwnedFd},
    time::Duration,
};

/// Bytes of the kernel's `canfd_frame`; a frame of classic CAN is its first 16.
const FRAME: usize = 72;
const CLASSIC: usize = 16;
/// Where the data of both begin.
const DATA: usize = 8;
/// Flags of the identifier: 29 bits, a request, an error.
const EXTENDED: u32 = 1 << 31;
const REQUEST: u32 = 1 << 30;
const ERROR: u32 = 1 << 29;

/// An open interface.
pub struct Can {
    socket: OwnedFd,
    name: String,
    line: String,
}

impl Can {
    /// Opens it for every frame that passes, CAN FD's too where the kernel knows them.
    ///
    /// # Errors
    /// The kernel has no CAN, or no such interface.
    #[allow(unsafe_code, reason = "neither std nor rustix knows the addresses of CAN")]
    pub fn open(name: &str) -> io::Result<Self> {
        let c_name = std::ffi::CString::new(name)?;
        let kind = libc::SOCK_RAW | libc::SOCK_CLOEXEC | libc::SOCK_NONBLOCK;
        // SAFETY: plain numbers; the descriptor that comes is nobody else's.
        let socket = unsafe {
            let fd = of_call(libc::socket(libc::AF_CAN, kind, libc::CAN_RAW))?;
            OwnedFd::from_raw_fd(fd)
        };
        // SAFETY: a string that ends with a zero.
        let index = unsafe { libc::if_nametoindex(c_name.as_ptr()) };
        if index == 0 {
            return Err(io::Error::last_os_error());
        }
        // An old kernel gives frames of classic CAN only.
        let _ = switch_on(&socket, libc::SOL_CAN_RAW, libc::CAN_RAW_FD_FRAMES);
        switch_on(&socket, libc::SOL_SOCKET, libc::SO_TIMESTAMPNS)?;
        // SAFETY: all zero is a valid address of this kind.
        let mut address: libc::sockaddr_can = unsafe { std::mem::zeroed() };
        address.can_family = libc::AF_CAN as libc::sa_family_t;
        address.can_ifindex = index.cast_signed();
        let length = size_of::<libc::sockaddr_can>() as libc::socklen_t;
        // SAFETY: the address lives until the call is over, and is as long as is said.
        of_call(unsafe { libc::bind(socket.as_raw_fd(), (&raw const address).cast(), length) })?;
        Ok(Self { socket, name: name.to_owned(), line: String::new() })
    }

    /// The next frame, how long it is, and the kernel's time, ns since 1970.
    #[allow(unsafe_code, reason = "the kernel's time comes beside the frame, which only recvmsg tells")]
    fn receive(&self, frame: &mut [u8; FRAME]) -> io::Result<(usize, Option<i64>)> {
        // Room for one time, aligned as the kernel's heads are.
        let mut beside = [0_u64; 8];
        let mut part = libc::iovec { iov_base: frame.as_mut_ptr().cast(), iov_len: FRAME };
        // SAFETY: all zero is a valid message; its pointers are set to what lives until the call is over.
        let mut message: libc::msghdr = unsafe { std::mem::zeroed() };
        message.msg_iov = &raw mut part;
        message.msg_iovlen = 1;
        message.msg_control = beside.as_mut_ptr().cast();
        message.msg_controllen = size_of_val(&beside) as _;
        // SAFETY: see above.
        let got = unsafe { libc::recvmsg(self.socket.as_raw_fd(), &raw mut message, 0) };
        let got = usize::try_from(got).map_err(|_| io::Error::last_os_error())?;
        let mut time = None;
        // SAFETY: the kernel wrote the heads that these calls walk over, within the room that was given.
        unsafe {
            let mut head = libc::CMSG_FIRSTHDR(&raw const message);
            while !head.is_null() {
                if (*head).cmsg_level == libc::SOL_SOCKET && (*head).cmsg_type == libc::SCM_TIMESTAMPNS {
                    let of: libc::timespec = std::ptr::read_unaligned(libc::CMSG_DATA(head).cast());
                    time = Some(of.tv_sec * 1_000_000_000 + of.tv_nsec);
                }
                head = libc::CMSG_NXTHDR(&raw const message, head);
            }
        }
        Ok((got, time))
    }
}

#[allow(unsafe_code, reason = "see `Can::open`")]
fn switch_on(socket: &OwnedFd, level: libc::c_int, option: libc::c_int) -> io::Result<()> {
    let on: libc::c_int = 1;
    let length = size_of::<libc::c_int>() as libc::socklen_t;
    // SAFETY: the value lives until the call is over, and is as long as is said.
    of_call(unsafe { libc::setsockopt(socket.as_raw_fd(), level, option, (&raw const on).cast(), length) }).map(drop)
}

fn of_call(code: libc::c_int) -> io::Result<libc::c_int> {
    if code < 0 { Err(io::Error::last_os_error()) } else { Ok(code) }
}

/// The line of a frame as the kernel gives it; `false` where it has no data to tell.
fn write_line(line: &mut String, bytes: &[u8], time_ns: i64, name: &str) -> bool {
    line.clear();
    let Some((head, data)) = bytes.split_first_chunk::<DATA>() else { return false };
    let id = u32::from_ne_bytes([head[0], head[1], head[2], head[3]]);
    if id & (REQUEST | ERROR) != 0 || !matches!(bytes.len(), CLASSIC | FRAME) {
        return false;
    }
    let Some(data) = data.get(..usize::from(head[4])) else { return false };
    let _ = write!(line, "({}.{:09}) {name} ", time_ns / 1_000_000_000, time_ns % 1_000_000_000);
    let _ = if id & EXTENDED == 0 { write!(line, "{id:03X}#") } else { write!(line, "{:08X}#", id & !EXTENDED) };
    if bytes.len() == FRAME {
        let _ = write!(line, "#{:X}", head[5] & 0xf);
    }
    for byte in data {
        let _ = write!(line, "{byte:02X}");
    }
    line.push('\n');
    true
}

impl Link for Can {
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Got> {
        if !has_come(&self.socket, patience)? {
            return Ok(Got::Nothing);
        }
        let mut frame = [0; FRAME];
        let (got, time) = match self.receive(&mut frame) {
            Ok(found) => found,
            Err(e) if matches!(e.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {
                return Ok(Got::Nothing);
            }
            Err(e) => return Err(e),
        };
        let Some(time) = time else { return Err(io::Error::other("the kernel gives no times of frames")) };
        if !write_line(&mut self.line, &frame[..got], time, &self.name) {
            return Ok(Got::Nothing);
        }
        let Some(place) = buffer.get_mut(..self.line.len()) else { return Ok(Got::Nothing) };
        place.copy_from_slice(self.line.as_bytes());
        Ok(Got::Bytes(self.line.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use log_readers::can::{Line, Lines, Writer};
    use std::process::Command;

    fn raw(id: u32, data: &[u8], length: usize) -> Vec<u8> {
        let mut bytes = id.to_ne_bytes().to_vec();
        bytes.extend([data.len() as u8, 1, 0, 0]);
        bytes.extend(data);
        bytes.resize(length, 0);
        bytes
    }

    #[test]
    fn what_the_kernel_gives_is_the_frame_that_candump_writes() {
        let mut line = String::new();
        for (id, data, length) in [
            (0x44, vec![0x2a, 0x36], CLASSIC),
            (0x18fe_f1d5 | EXTENDED, vec![], CLASSIC),
            (0x123, (0..48).collect(), FRAME),
        ] {
            assert!(write_line(&mut line, &raw(id, &data, length), 1_700_000_000_000_000_042, "can0"));
            let Line::Frame(frame) = Lines::new(Writer::Candump).next(line.as_bytes()) else { panic!("{line}") };
            assert_eq!((frame.id, frame.data(), frame.bus), (id, &data[..], &b"can0"[..]));
            assert_eq!(frame.time_ns, Some(1_700_000_000_000_000_042));
        }
        for bytes in [
            raw(0x44 | REQUEST, &[], CLASSIC),
            raw(0x44 | ERROR, &[0; 8], CLASSIC),
            raw(1, &[0; 64], CLASSIC),
            vec![0; 7],
        ] {
            assert!(!write_line(&mut line, &bytes, 0, "can0"), "{bytes:?}");
        }
    }

    #[test]
    fn frames_come_over_a_virtual_bus() {
        let name = "vcantruerate";
        let ran = |words: &[&str]| Command::new("ip").args(words).output().is_ok_and(|output| output.status.success());
        if !ran(&["link", "add", "dev", name, "type", "vcan"]) {
            eprintln!("skipped: no virtual CAN bus can be made here (ip link add type vcan)");
            return;
        }
        let up = ran(&["link", "set", name, "up"]);
        let opened = Can::open(name).and_then(|mut ours| {
            let theirs = Can::open(name)?;
            rustix::io::write(&theirs.socket, &raw(0x123, &[1, 2, 3], CLASSIC))?;
            let mut buffer = [0; 1024];
            match ours.read(&mut buffer, Duration::from_secs(20))? {
                Got::Bytes(n) => Ok(String::from_utf8_lossy(&buffer[..n]).into_owned()),
                other => Err(io::Error::other(format!("{other:?}"))),
            }
        });
        ran(&["link", "delete", name]);
        assert!(up && opened.is_ok_and(|line| line.ends_with(" vcantruerate 123#010203\n")));
    }
}
