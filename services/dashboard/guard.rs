//! Who may look and who may change: the page of this very dashboard, for this user on this machine, or with the token.
//!
//! A web page of another origin can make a browser send requests here. It is told apart by `Origin` and
//! `Sec-Fetch-Site`, and one that gave itself our address (DNS rebinding) by `Host`. Beyond loopback anyone can
//! connect, and over it every user of this machine, so of those everything wants the token.

use axum::http::{HeaderMap, Method, header};
use std::{
    fs::File,
    io::Read,
    net::{Ipv4Addr, Ipv6Addr, SocketAddr},
};

/// Name of the cookie that carries the token after the first visit.
pub const COOKIE: &str = "truerate-token";

/// The rules of one dashboard.
#[derive(Clone, Debug)]
pub struct Guard {
    address: SocketAddr,
    token: String,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// The name in the address bar isn't ours.
    #[error(
        "this dashboard does not answer to that host name; open it by the address that was printed when it started"
    )]
    Host,
    /// A page of another origin asks.
    #[error("commands are taken from this dashboard's own page only")]
    Origin,
    /// From another machine or user, without the token.
    #[error(
        "other users need this dashboard's token: open its address with ?token=…; the token is in dashboard.token in the \
         pipeline's folder"
    )]
    Token,
}

impl Guard {
    /// For a dashboard that listens here; it keeps the token that it had, or draws one.
    ///
    /// # Errors
    /// Where the system has no random numbers.
    pub fn of(address: SocketAddr, kept: Option<String>) -> std::io::Result<Self> {
        let kept = kept.filter(|t| t.len() == 32 && t.bytes().all(|b| b.is_ascii_hexdigit()));
        let token = kept.map_or_else(random_token, Ok)?;
        Ok(Self { address, token })
    }

    /// The token.
    #[must_use]
    pub fn token(&self) -> &str {
        &self.token
    }

    /// The address to open for the user who runs it; on this machine, where it listens at every address.
    #[must_use]
    pub fn url(&self) -> String {
        let token = if self.is_local() { String::new() } else { format!("?token={}", self.token) };
        let mut address = self.address;
        if self.is_everywhere() {
            address.set_ip(if address.is_ipv4() { Ipv4Addr::LOCALHOST.into() } else { Ipv6Addr::LOCALHOST.into() });
        }
        format!("http://{address}/{token}")
    }

    /// Whether it listens at every address of this machine.
    #[must_use]
    pub fn is_everywhere(&self) -> bool {
        self.address.ip().is_unspecified()
    }

    /// Whether it listens to this machine alone.
    #[must_use]
    pub fn is_local(&self) -> bool {
        self.address.ip().is_loopback()
    }

    /// Checks one request, of a connection that is this user's own over loopback, or another.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn check(&self, own: bool, method: &Method, headers: &HeaderMap, query: Option<&str>) -> Result<(), Refused> {
        let text = |name| headers.get(name).and_then(|v| v.to_str().ok());
        let host = text(header::HOST).ok_or(Refused::Host)?;
        if !presented(headers, query).any(|t| same(t, &self.token)) {
            if !(own && self.is_local()) {
                return Err(Refused::Token);
            }
            if !self.is_ours(host) {
                return Err(Refused::Host);
            }
        }
        let origin = text(header::ORIGIN);
        let foreign = origin.is_some_and(|o| o.strip_prefix("http://") != Some(host))
            || text(header::HeaderName::from_static("sec-fetch-site"))
                .is_some_and(|s| s == "cross-site" || s == "same-site");
        // To look from another page is harmless only for the first page itself (a link); everything else stays here.
        let navigation =
            text(header::HeaderName::from_static("sec-fetch-mode")) == Some("navigate") && origin.is_none();
        if foreign && !(method == Method::GET && navigation) {
            return Err(Refused::Origin);
        }
        Ok(())
    }

    fn is_ours(&self, host: &str) -> bool {
        let port = self.address.port();
        ["127.0.0.1", "localhost", "[::1]"]
            .iter()
            .any(|name| host == format!("{name}:{port}") || port == 80 && host == *name)
            || host == self.address.to_string()
    }
}

/// Tokens that a request carries: in its cookie and in its query.
fn presented<'a>(headers: &'a HeaderMap, query: Option<&'a str>) -> impl Iterator<Item = &'a str> {
    let cookies = headers.get_all(header::COOKIE).iter().filter_map(|v| v.to_str().ok()).flat_map(|v| v.split(';'));
    let in_cookie = cookies.filter_map(|c| c.trim().strip_prefix(COOKIE)?.strip_prefix('='));
    in_cookie.chain(query.into_iter().flat_map(|q| q.split('&')).filter_map(|p| p.strip_prefix("token=")))
}

/// Compares without telling by its time how far the two agree.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |d, (x, y)| d | (x ^ y)) == 0
}

fn random_token() -> std::io::Result<String> {
    let mut bytes = [0; 16];
    File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(format!("{:032x}", u128::from_ne_bytes(bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(pairs: &[(&'static str, &str)]) -> HeaderMap {
        pairs.iter().map(|(k, v)| (header::HeaderName::from_static(k), v.parse().unwrap())).collect()
    }

    fn local() -> Guard {
        Guard::of("127.0.0.1:7777".parse().unwrap(), None).unwrap()
    }

    #[test]
    fn our_own_page_may_command() {
        for host in ["127.0.0.1:7777", "localhost:7777"] {
            let origin = format!("http://{host}");
            let h = headers(&[("host", host), ("origin", &origin), ("sec-fetch-site", "same-origin")]);
            assert_eq!(local().check(true, &Method::POST, &h, None), Ok(()));
        }
    }

    #[test]
    fn a_page_of_another_origin_may_neither_command_nor_read() {
        for (name, value) in [("origin", "http://evil.example"), ("origin", "null"), ("sec-fetch-site", "cross-site")] {
            let h = headers(&[("host", "127.0.0.1:7777"), (name, value)]);
            assert_eq!(local().check(true, &Method::POST, &h, None), Err(Refused::Origin), "{name}: {value}");
            assert_eq!(local().check(true, &Method::GET, &h, None), Err(Refused::Origin), "{name}: {value}");
        }
    }

    #[test]
    fn a_name_that_was_bent_to_our_address_is_refused() {
        let h = headers(&[("host", "evil.example:7777"), ("origin", "http://evil.example:7777")]);
        assert_eq!(local().check(true, &Method::POST, &h, None), Err(Refused::Host));
        assert_eq!(local().check(true, &Method::GET, &HeaderMap::new(), None), Err(Refused::Host));
    }

    #[test]
    fn a_link_from_elsewhere_opens_the_page() {
        let h =
            headers(&[("host", "localhost:7777"), ("sec-fetch-site", "cross-site"), ("sec-fetch-mode", "navigate")]);
        assert_eq!(local().check(true, &Method::GET, &h, None), Ok(()));
        assert_eq!(local().check(true, &Method::POST, &h, None), Err(Refused::Origin));
    }

    #[test]
    fn beyond_loopback_everything_wants_the_token() {
        let guard = Guard::of("192.168.1.5:7777".parse().unwrap(), None).unwrap();
        let token = guard.token().to_owned();
        let h = headers(&[("host", "192.168.1.5:7777")]);
        assert_eq!(guard.check(true, &Method::GET, &h, None), Err(Refused::Token));
        assert_eq!(guard.check(true, &Method::GET, &h, Some("token=00")), Err(Refused::Token));
        assert_eq!(guard.check(true, &Method::GET, &h, Some(&format!("token={token}"))), Ok(()));
        let cookie = format!("a=b; {COOKIE}={token}");
        let h = headers(&[("host", "192.168.1.5:7777"), ("cookie", &cookie)]);
        assert_eq!(guard.check(true, &Method::POST, &h, None), Ok(()));
    }

    #[test]
    fn another_user_of_this_machine_wants_the_token() {
        let h = headers(&[("host", "127.0.0.1:7777")]);
        let guard = local();
        assert_eq!(guard.check(false, &Method::GET, &h, None), Err(Refused::Token));
        let query = format!("token={}", guard.token());
        assert_eq!(guard.check(false, &Method::GET, &h, Some(&query)), Ok(()));
        assert!(!guard.url().contains("token"), "its own user needs none");
    }

    #[test]
    fn the_address_that_is_told_can_be_opened() {
        for (listens, opens) in [
            ("127.0.0.1:7777", "http://127.0.0.1:7777/"),
            ("192.168.1.5:7777", "http://192.168.1.5:7777/?token="),
            ("0.0.0.0:7777", "http://127.0.0.1:7777/?token="),
            ("[::]:7777", "http://[::1]:7777/?token="),
        ] {
            let url = Guard::of(listens.parse().unwrap(), None).unwrap().url();
            assert!(url.starts_with(opens), "{url}");
        }
    }
}
