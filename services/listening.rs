//! Where a dashboard listens: `HOST:PORT`, or `HOST:FIRST-LAST` for the first of these ports that is free.

use anyhow::{Context, ensure};
use std::{
    io,
    net::{SocketAddr, TcpListener, ToSocketAddrs},
};

/// One address, or one for each port of a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Address {
    first: SocketAddr,
    last: u16,
}

impl Address {
    /// Reads `HOST:PORT`, `HOST:FIRST-LAST` or `off`, which is `None`.
    ///
    /// # Errors
    /// Where it is no address.
    pub fn parse(text: &str) -> anyhow::Result<Option<Self>> {
        if text == "off" {
            return Ok(None);
        }
        let what = || {
            format!(
                "dashboard '{text}': no address: use HOST:PORT, such as 127.0.0.1:7777, HOST:FIRST-LAST for the first \
                 free port of these, or off"
            )
        };
        let (one, last) = match text.rsplit_once('-') {
            Some((one, last)) if one.contains(':') => (one, Some(last.parse::<u16>().with_context(what)?)),
            _ => (text, None),
        };
        let first = one.to_socket_addrs().with_context(what)?.next();
        let first = first.with_context(|| format!("dashboard '{text}': no such host"))?;
        let last = last.unwrap_or(first.port());
        ensure!(first.port() <= last, what());
        Ok(Some(Self { first, last }))
    }

    /// Listens there: at `earlier`, if it is one of the ports, or else at the first that is free.
    ///
    /// # Errors
    /// Of the last port that was tried, with its address.
    pub fn listen(&self, earlier: Option<u16>) -> io::Result<TcpListener> {
        let ports = self.first.port()..=self.last;
        let mut refused = None;
        for port in earlier.into_iter().filter(|port| self.has(*port)).chain(ports) {
            let address = SocketAddr::new(self.first.ip(), port);
            match TcpListener::bind(address) {
                Ok(listener) => return Ok(listener),
                Err(error) => refused = Some(io::Error::new(error.kind(), format!("{address}: {error}"))),
            }
        }
        Err(refused.unwrap_or_else(|| io::ErrorKind::AddrNotAvailable.into()))
    }

    /// Port 0 stands for any.
    fn has(&self, port: u16) -> bool {
        self.first.port() == 0 || (self.first.port()..=self.last).contains(&port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Address {
        Address::parse(text).unwrap().unwrap()
    }

    #[test]
    fn an_address_has_a_host_and_a_port_or_a_range_of_them() {
        assert_eq!(Address::parse("off").unwrap(), None);
        let one = parsed("127.0.0.1:7777");
        assert_eq!((one.first.port(), one.last), (7777, 7777));
        let range = parsed("[::1]:7777-7876");
        assert_eq!((range.first.port(), range.last, range.first.is_ipv6()), (7777, 7876, true));
        for text in ["7777", "", "127.0.0.1", "127.0.0.1:99999", "127.0.0.1:9-8", "127.0.0.1:9-x", "7777-7778"] {
            let error = format!("{:#}", Address::parse(text).unwrap_err());
            assert!(error.contains("HOST:PORT"), "{error}");
        }
    }

    #[test]
    fn two_that_want_the_same_range_get_neighbouring_ports_and_one_that_returns_its_own() {
        let first = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = first.local_addr().unwrap().port();
        let range = Address { first: first.local_addr().unwrap(), last: port.saturating_add(50) };
        let second = range.listen(None).unwrap().local_addr().unwrap();
        assert!(second.port() > port);
        drop(first);
        assert_eq!(range.listen(Some(second.port())).unwrap().local_addr().unwrap(), second);
        assert_ne!(range.listen(Some(1)).unwrap().local_addr().unwrap().port(), 1);
    }

    #[test]
    fn a_port_that_is_in_use_is_named() {
        let taken = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = taken.local_addr().unwrap();
        let error = parsed(&address.to_string()).listen(None).unwrap_err();
        assert!(error.to_string().starts_with(&format!("{address}: ")), "{error}");
    }
}
