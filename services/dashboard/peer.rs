//! Which user of this machine has opened a connection over loopback: what the kernel says of its other end.

use std::{
    fs,
    net::{IpAddr, SocketAddr},
};

/// State of a connection that both ends hold, in the kernel's table.
const ESTABLISHED: &str = "01";

/// Whether the process that connected from `peer` to `local` is this very user's, or root's. Where the kernel does not know
/// (another machine, another network namespace, an end that is closed already) it is not.
#[must_use]
pub fn is_ours(peer: SocketAddr, local: SocketAddr) -> bool {
    let table = if peer.is_ipv4() { "/proc/net/tcp" } else { "/proc/net/tcp6" };
    let text = fs::read_to_string(table).unwrap_or_default();
    owner(&text, peer, local).is_some_and(|uid| uid == 0 || uid == rustix::process::geteuid().as_raw())
}

/// The user of the end `peer` of a connection, by a table of the kernel's.
fn owner(table: &str, peer: SocketAddr, local: SocketAddr) -> Option<u32> {
    let ends = (kernels(peer), kernels(local));
    table.lines().skip(1).find_map(|line| {
        let mut words = line.split_whitespace().skip(1);
        let (from, to, state) = (words.next()?, words.next()?, words.next()?);
        let found = from == ends.0 && to == ends.1 && state == ESTABLISHED;
        // Queues, timer and retransmissions stand between.
        if found { words.nth(3)?.parse().ok() } else { None }
    })
}

/// An address as the kernel's tables have it: words of four bytes in this machine's order.
fn kernels(address: SocketAddr) -> String {
    let words = |bytes: &[u8]| -> String {
        let word = |four: &[u8]| format!("{:08X}", u32::from_ne_bytes([four[0], four[1], four[2], four[3]]));
        bytes.chunks_exact(4).map(word).collect()
    };
    let ip = match address.ip() {
        IpAddr::V4(ip) => words(&ip.octets()),
        IpAddr::V6(ip) => words(&ip.octets()),
    };
    format!("{ip}:{:04X}", address.port())
}

#[cfg(test)]
mod tests {
    use super::{is_ours, owner};
    use std::net::{TcpListener, TcpStream};

    #[test]
    fn a_connection_of_ours_is_known_over_both_kinds_of_loopback() {
        for place in ["127.0.0.1:0", "[::1]:0"] {
            let Ok(listener) = TcpListener::bind(place) else {
                eprintln!("skipped: there is no {place} here");
                continue;
            };
            let local = listener.local_addr().unwrap();
            let client = TcpStream::connect(local).unwrap();
            let (_server, peer) = listener.accept().unwrap();
            assert!(is_ours(peer, local), "{peer}");
            drop(client);
            assert!(!is_ours(peer, local), "one that is closed is nobody's");
        }
    }

    #[test]
    fn the_user_is_the_one_of_the_other_end() {
        let table = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n   \
                     0: 0100007F:1E61 0100007F:C350 01 00000000:00000000 00:00000000 00000000   977        0 1 1 0\n   \
                     1: 0100007F:C350 0100007F:1E61 01 00000000:00000000 00:00000000 00000000  1000        0 2 1 0\n";
        let (peer, local) = ("127.0.0.1:50000".parse().unwrap(), "127.0.0.1:7777".parse().unwrap());
        if cfg!(target_endian = "little") {
            assert_eq!(owner(table, peer, local), Some(1000));
        }
        assert_eq!(owner(&table.replace(" 01 ", " 06 "), peer, local), None);
        assert_eq!(owner("", peer, local), None);
    }
}
