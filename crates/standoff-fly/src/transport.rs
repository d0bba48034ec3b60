//! Sockets and serial port: a thread per input passes what arrives to one bounded queue.

use std::io::{self, Read, Write};
use std::net::{IpAddr, SocketAddr, TcpStream, ToSocketAddrs, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use crate::address::LinkAddress;

/// Maximum number of received datagrams that wait; further ones are dropped.
const QUEUE_MAX: usize = 4096;

/// Time after which a thread checks whether the program ends.
const POLL: Duration = Duration::from_millis(200);

/// Time for which the vehicle's address must be silent before another address may replace it.
const PEER_TIMEOUT: Duration = Duration::from_secs(5);

/// Time to wait for a TCP connection.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// Longest datagram, bytes.
const DATAGRAM_MAX: usize = 65_536;

/// Input that has received something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Input {
    /// Link to the autopilot.
    Autopilot,
    /// Feed of detections.
    Feed,
    /// Teammates.
    Teammates,
}

/// Something received.
#[derive(Debug)]
pub(crate) struct Received {
    pub(crate) input: Input,
    pub(crate) at: Instant,
    /// Sender of a datagram; `None` for a stream.
    pub(crate) from: Option<SocketAddr>,
    /// Bytes, or why the input has ended.
    pub(crate) bytes: Result<Vec<u8>, String>,
}

/// Queue of all inputs.
pub(crate) struct Inputs {
    sender: SyncSender<Received>,
    receiver: Receiver<Received>,
    is_over: Arc<AtomicBool>,
}

impl Inputs {
    pub(crate) fn new() -> Self {
        let (sender, receiver) = sync_channel(QUEUE_MAX);
        Self { sender, receiver, is_over: Arc::new(AtomicBool::new(false)) }
    }

    /// Waits for the next input, at most for a time.
    pub(crate) fn next(&self, timeout: Duration) -> Option<Received> {
        self.receiver.recv_timeout(timeout).ok()
    }

    /// Starts a thread that receives datagrams.
    pub(crate) fn listen(&self, input: Input, socket: &UdpSocket) -> io::Result<()> {
        let socket = socket.try_clone()?;
        socket.set_read_timeout(Some(POLL))?;
        let mut datagram = vec![0; DATAGRAM_MAX];
        self.start(input, move || {
            // Errors of single datagrams (a port of a receiver is closed) are not those of the socket.
            Ok(socket.recv_from(&mut datagram).ok().map(|(length, from)| (datagram[..length].to_vec(), Some(from))))
        })
    }

    /// Starts a thread that receives a stream.
    fn read(&self, input: Input, mut stream: impl Read + Send + 'static) -> io::Result<()> {
        let mut buffer = vec![0; 4096];
        self.start(input, move || match stream.read(&mut buffer) {
            Ok(0) => Err("the other side has closed the connection".to_owned()),
            Ok(length) => Ok(Some((buffer[..length].to_vec(), None))),
            Err(error) if is_timeout(&error) => Ok(None),
            Err(error) => Err(error.to_string()),
        })
    }

    fn start(
        &self,
        input: Input,
        mut receive: impl FnMut() -> Result<Option<(Vec<u8>, Option<SocketAddr>)>, String> + Send + 'static,
    ) -> io::Result<()> {
        let (sender, is_over) = (self.sender.clone(), Arc::clone(&self.is_over));
        let run = move || {
            while !is_over.load(Ordering::Relaxed) {
                let (bytes, from) = match receive() {
                    Ok(None) => continue,
                    Ok(Some((bytes, from))) => (Ok(bytes), from),
                    Err(reason) => (Err(reason), None),
                };
                let is_end = bytes.is_err();
                let sent = sender.try_send(Received { input, at: Instant::now(), from, bytes });
                if is_end || matches!(sent, Err(TrySendError::Disconnected(_))) {
                    return;
                }
            }
        };
        thread::Builder::new().name(format!("{input:?}")).spawn(run).map(|_| ())
    }
}

impl Drop for Inputs {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
    }
}

fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

/// Open link to the autopilot.
pub(crate) enum Link {
    /// Datagrams; the peer is unknown until the vehicle has sent a valid message.
    Udp { socket: UdpSocket, peer: Option<(SocketAddr, Instant)>, is_fixed: bool },
    /// Bytes without boundaries.
    Stream(Box<dyn Write>),
}

impl Link {
    /// Opens a link, and starts to receive from it.
    pub(crate) fn open(address: &LinkAddress, inputs: &Inputs, now: Instant) -> io::Result<Self> {
        let input = Input::Autopilot;
        match address {
            LinkAddress::UdpIn(local) => {
                let socket = UdpSocket::bind(local.as_str())?;
                inputs.listen(input, &socket)?;
                Ok(Self::Udp { socket, peer: None, is_fixed: false })
            }
            LinkAddress::UdpOut(remote) => {
                let peer = resolve(remote)?;
                let any: SocketAddr = if peer.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
                let socket = UdpSocket::bind(any)?;
                inputs.listen(input, &socket)?;
                Ok(Self::Udp { socket, peer: Some((peer, now)), is_fixed: true })
            }
            LinkAddress::Tcp(remote) => {
                let stream = TcpStream::connect_timeout(&resolve(remote)?, CONNECT_TIMEOUT)?;
                stream.set_nodelay(true)?;
                stream.set_read_timeout(Some(POLL))?;
                // A receiver that does not read must not stop the program.
                stream.set_write_timeout(Some(Duration::from_millis(50)))?;
                inputs.read(input, stream.try_clone()?)?;
                Ok(Self::Stream(Box::new(stream)))
            }
            LinkAddress::Serial(device, baud) => {
                let port = serialport::new(device, *baud).timeout(POLL).open().map_err(io::Error::other)?;
                inputs.read(input, port.try_clone().map_err(io::Error::other)?)?;
                Ok(Self::Stream(Box::new(port)))
            }
        }
    }

    /// True if datagrams from this address are read: those of the peer, and of any address while there is no peer.
    pub(crate) fn accepts(&self, from: Option<SocketAddr>, now: Instant) -> bool {
        match self {
            Self::Udp { peer: Some((peer, _)), is_fixed: true, .. } => from == Some(*peer),
            Self::Udp { peer: Some((peer, heard_at)), .. } => {
                from == Some(*peer) || now.saturating_duration_since(*heard_at) > PEER_TIMEOUT
            }
            Self::Udp { peer: None, .. } | Self::Stream(_) => true,
        }
    }

    /// Makes the sender of a valid message of the vehicle the peer.
    pub(crate) fn confirm(&mut self, from: Option<SocketAddr>, now: Instant) {
        if let (Self::Udp { peer, is_fixed: false, .. }, Some(from)) = (self, from) {
            *peer = Some((from, now));
        }
    }

    /// Sends a frame. Lost datagrams are not errors.
    pub(crate) fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        match self {
            Self::Udp { socket, peer, .. } => {
                if let Some((peer, _)) = peer {
                    let _ = socket.send_to(frame, *peer);
                }
                Ok(())
            }
            Self::Stream(stream) => match stream.write_all(frame) {
                Err(error) if !is_timeout(&error) => Err(error),
                _ => Ok(()),
            },
        }
    }
}

/// First address of a host name and port.
pub(crate) fn resolve(address: &str) -> io::Result<SocketAddr> {
    let mut found = address.to_socket_addrs()?;
    found.next().ok_or_else(|| io::Error::other(format!("{address}: the host has no address")))
}

/// Datagrams to and from the teammates.
pub(crate) struct Radio {
    socket: UdpSocket,
    teammates: Vec<SocketAddr>,
}

impl Radio {
    /// Opens the socket on which teammates are received.
    pub(crate) fn open(local: &str, teammates: &[String], inputs: &Inputs) -> io::Result<Self> {
        let socket = UdpSocket::bind(local)?;
        inputs.listen(Input::Teammates, &socket)?;
        Ok(Self { socket, teammates: teammates.iter().map(|at| resolve(at)).collect::<io::Result<_>>()? })
    }

    /// True for the host of a teammate.
    pub(crate) fn accepts(&self, from: Option<SocketAddr>) -> bool {
        let hosts = || self.teammates.iter().map(SocketAddr::ip);
        from.is_some_and(|from: SocketAddr| hosts().any(|host: IpAddr| host == from.ip()))
    }

    /// Sends a datagram to every teammate. Errors are ignored: the agent handles lost messages.
    pub(crate) fn send(&self, datagram: &[u8]) {
        for teammate in &self.teammates {
            let _ = self.socket.send_to(datagram, *teammate);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;
    use crate::codec::Codec;
    use crate::command;

    /// Bytes of some frames, in pieces that cut frames, as a stream delivers them.
    fn exchange(mut link: Link, inputs: &Inputs, mut other: impl Read + Write) {
        let (mut vehicle, mut companion) = (Codec::new(1, None), Codec::new(1, None));
        let frames: Vec<u8> = (0..20).flat_map(|_| vehicle.encode(&command::roll(1, 0.2))).collect();
        for piece in frames.chunks(37) {
            other.write_all(piece).unwrap();
        }
        let mut heard = 0;
        while heard < 20 {
            let received = inputs.next(Duration::from_secs(10)).expect("all frames arrive");
            assert_eq!((received.input, received.from), (Input::Autopilot, None));
            companion.decode_stream(&received.bytes.unwrap(), |_, _| heard += 1);
        }
        let frame = companion.encode(&command::heartbeat());
        link.send(&frame).unwrap();
        let mut arrived = vec![0; frame.len()];
        other.read_exact(&mut arrived).unwrap();
        assert_eq!(arrived, frame);
    }

    /// Waits for the end of an input.
    fn end(inputs: &Inputs) -> String {
        loop {
            if let Err(reason) = inputs.next(Duration::from_secs(10)).expect("the input ends").bytes {
                return reason;
            }
        }
    }

    #[test]
    fn a_tcp_link_carries_frames_both_ways_and_its_end_is_reported() {
        let (inputs, server) = (Inputs::new(), TcpListener::bind("127.0.0.1:0").unwrap());
        let address = LinkAddress::Tcp(server.local_addr().unwrap().to_string());
        let link = Link::open(&address, &inputs, Instant::now()).unwrap();
        let (other, _) = server.accept().unwrap();
        exchange(link, &inputs, other);
        assert_eq!(end(&inputs), "the other side has closed the connection");
        drop(server);
        assert!(Link::open(&address, &inputs, Instant::now()).is_err(), "nothing listens there any more");
    }

    /// A receiver that does not read must not stop the program.
    #[test]
    fn a_full_tcp_link_delays_a_step_by_at_most_50_ms_per_frame() {
        let (inputs, server) = (Inputs::new(), TcpListener::bind("127.0.0.1:0").unwrap());
        let address = LinkAddress::Tcp(server.local_addr().unwrap().to_string());
        let mut link = Link::open(&address, &inputs, Instant::now()).unwrap();
        let _other = server.accept().unwrap();
        let block = vec![0; 1 << 20];
        let mut longest = Duration::ZERO;
        for _ in 0..20 {
            let begun = Instant::now();
            link.send(&block).unwrap();
            longest = longest.max(begun.elapsed());
        }
        assert!((Duration::from_millis(40)..Duration::from_secs(2)).contains(&longest), "{longest:?}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_serial_link_carries_frames_both_ways_over_a_pseudo_terminal() {
        use serialport::{SerialPort, TTYPort};
        let (mut other, mut port) = TTYPort::pair().unwrap();
        other.set_timeout(Duration::from_secs(10)).unwrap();
        let name = port.name().unwrap();
        port.set_exclusive(false).unwrap();
        drop(port);
        let inputs = Inputs::new();
        let link = Link::open(&LinkAddress::Serial(name, 57_600), &inputs, Instant::now()).unwrap();
        exchange(link, &inputs, other);
        end(&inputs);
        let missing = LinkAddress::Serial("/dev/no-such-port".to_owned(), 57_600);
        assert!(Link::open(&missing, &inputs, Instant::now()).is_err());
    }
}
