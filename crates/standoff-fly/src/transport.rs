//! Sockets and serial port: a thread per input passes what arrives to one bounded queue.

use std::io::{self, Read, Write};
use std::net::{IpAddr, SocketAddr, TcpStream, ToSocketAddrs, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::address::LinkAddress;

/// Maximum number of received datagrams that wait; further ones are dropped.
const QUEUE_MAX: usize = 4096;

/// Time after which a thread checks whether the program ends.
const POLL: Duration = Duration::from_millis(200);

/// Time for which the vehicle's address must be silent before another address may replace it.
const PEER_TIMEOUT: Duration = Duration::from_secs(5);

/// Times to wait before a stream is opened again: at first, and at most.
const REOPEN: [Duration; 2] = [Duration::from_millis(500), Duration::from_secs(5)];

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
    /// Bytes, or why there are none; the input is opened again.
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

    /// Starts a thread that receives a stream, and opens it again when it ends. Returns its writer.
    fn read(&self, input: Input, open: impl Fn() -> io::Result<Stream> + Send + 'static) -> io::Result<Writer> {
        let (mut reader, writer) = open()?;
        let writer = Arc::new(Mutex::new(Some(writer)));
        let shared = Arc::clone(&writer);
        let mut buffer = vec![0; 4096];
        let mut wait = None;
        self.start(input, move || {
            if let Some(time) = wait {
                thread::sleep(time);
                let Ok((again, writer)) = open() else {
                    wait = Some((2 * time).min(REOPEN[1]));
                    return Ok(None);
                };
                (reader, wait) = (again, None);
                *shared.lock().unwrap_or_else(PoisonError::into_inner) = Some(writer);
            }
            let reason = match reader.read(&mut buffer) {
                Ok(0) => "the other side has closed the connection".to_owned(),
                Ok(length) => return Ok(Some((buffer[..length].to_vec(), None))),
                Err(error) if is_timeout(&error) => return Ok(None),
                Err(error) => error.to_string(),
            };
            *shared.lock().unwrap_or_else(PoisonError::into_inner) = None;
            wait = Some(REOPEN[0]);
            Err(reason)
        })?;
        Ok(writer)
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
                let sent = sender.try_send(Received { input, at: Instant::now(), from, bytes });
                if matches!(sent, Err(TrySendError::Disconnected(_))) {
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

/// Both sides of an open stream.
type Stream = (Box<dyn Read + Send>, Box<dyn Write + Send>);

/// Writer of a stream; `None` while the stream is not open.
type Writer = Arc<Mutex<Option<Box<dyn Write + Send>>>>;

/// Link to the autopilot.
pub(crate) enum Link {
    /// Datagrams; the peer is unknown until the vehicle has sent a valid message. Until then, frames go to the address
    /// from which frames with the right key and old time stamps come.
    Udp { socket: UdpSocket, peer: Option<(SocketAddr, Instant)>, behind: Option<SocketAddr>, is_fixed: bool },
    /// Bytes without boundaries.
    Stream(Writer),
}

impl Link {
    /// Opens a link, and starts to receive from it.
    pub(crate) fn open(address: &LinkAddress, inputs: &Inputs, now: Instant) -> io::Result<Self> {
        let input = Input::Autopilot;
        match address {
            LinkAddress::UdpIn(local) => {
                let socket = UdpSocket::bind(local.as_str())?;
                inputs.listen(input, &socket)?;
                Ok(Self::Udp { socket, peer: None, behind: None, is_fixed: false })
            }
            LinkAddress::UdpOut(remote) => {
                let peer = resolve(remote)?;
                let any: SocketAddr = if peer.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
                let socket = UdpSocket::bind(any)?;
                inputs.listen(input, &socket)?;
                Ok(Self::Udp { socket, peer: Some((peer, now)), behind: None, is_fixed: true })
            }
            LinkAddress::Tcp(remote) => {
                let remote = remote.clone();
                let open = move || -> io::Result<Stream> {
                    let stream = TcpStream::connect_timeout(&resolve(&remote)?, CONNECT_TIMEOUT)?;
                    stream.set_nodelay(true)?;
                    stream.set_read_timeout(Some(POLL))?;
                    // A receiver that does not read must not stop the program.
                    stream.set_write_timeout(Some(Duration::from_millis(50)))?;
                    Ok((Box::new(stream.try_clone()?), Box::new(stream)))
                };
                inputs.read(input, open).map(Self::Stream)
            }
            LinkAddress::Serial(device, baud) => {
                let (device, baud) = (device.clone(), *baud);
                let open = move || -> io::Result<Stream> {
                    let port = serialport::new(&device, baud).timeout(POLL).open()?;
                    Ok((Box::new(port.try_clone()?), Box::new(port)))
                };
                inputs.read(input, open).map(Self::Stream)
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

    /// Sends to the sender of a frame that has the right key and an old time stamp, while there is no peer.
    pub(crate) fn answer(&mut self, from: Option<SocketAddr>) {
        if let Self::Udp { behind, .. } = self {
            *behind = from;
        }
    }

    /// Address of the peer.
    pub(crate) fn peer(&self) -> Option<SocketAddr> {
        match self {
            Self::Udp { peer, .. } => peer.map(|(peer, _)| peer),
            Self::Stream(_) => None,
        }
    }

    /// Makes the sender of a valid message of the vehicle the peer.
    pub(crate) fn confirm(&mut self, from: Option<SocketAddr>, now: Instant) {
        if let (Self::Udp { peer, behind, is_fixed: false, .. }, Some(from)) = (self, from) {
            (*peer, *behind) = (Some((from, now)), None);
        }
    }

    /// Sends a frame. Lost frames are not errors: the reader of a stream notices its end.
    pub(crate) fn send(&mut self, frame: &[u8]) {
        match self {
            Self::Udp { socket, behind, .. } if behind.is_some() => {
                let _ = behind.map(|behind| socket.send_to(frame, behind));
            }
            Self::Udp { socket, peer, .. } => {
                let _ = peer.map(|(peer, _)| socket.send_to(frame, peer));
            }
            Self::Stream(writer) => {
                let mut writer = writer.lock().unwrap_or_else(PoisonError::into_inner);
                let _ = writer.as_mut().map(|writer| writer.write_all(frame));
            }
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
    fn exchange(link: &mut Link, inputs: &Inputs, mut other: impl Read + Write) {
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
        link.send(&frame);
        let mut arrived = vec![0; frame.len()];
        other.read_exact(&mut arrived).unwrap();
        assert_eq!(arrived, frame);
    }

    /// Waits until an input has failed.
    fn end(inputs: &Inputs) -> String {
        loop {
            if let Err(reason) = inputs.next(Duration::from_secs(10)).expect("the input fails").bytes {
                return reason;
            }
        }
    }

    #[test]
    fn a_tcp_link_carries_frames_both_ways_its_end_is_reported_and_it_is_opened_again() {
        let (inputs, server) = (Inputs::new(), TcpListener::bind("127.0.0.1:0").unwrap());
        let address = LinkAddress::Tcp(server.local_addr().unwrap().to_string());
        let mut link = Link::open(&address, &inputs, Instant::now()).unwrap();
        // Three times: the time to wait does not grow while connections succeed.
        for _ in 0..3 {
            let begun = Instant::now();
            let (other, _) = server.accept().unwrap();
            assert!(begun.elapsed() < Duration::from_secs(5));
            other.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
            // The writer follows its reader.
            thread::sleep(Duration::from_millis(100));
            exchange(&mut link, &inputs, other);
            assert_eq!(end(&inputs), "the other side has closed the connection");
            link.send(&[0]);
        }
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
            link.send(&block);
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
        let mut link = Link::open(&LinkAddress::Serial(name, 57_600), &inputs, Instant::now()).unwrap();
        exchange(&mut link, &inputs, other);
        end(&inputs);
        let missing = LinkAddress::Serial("/dev/no-such-port".to_owned(), 57_600);
        assert!(Link::open(&missing, &inputs, Instant::now()).is_err());
    }
}
