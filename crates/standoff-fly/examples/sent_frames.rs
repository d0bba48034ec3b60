//! Prints one frame of each kind of message that `standoff fly` sends, as hexadecimal digits: unsigned, then signed with a
//! key of 32 bytes 0x2a. `scripts/check_mavlink.py` decodes them with pymavlink.

use mavlink::dialects::ardupilotmega::MavMessage;
use standoff_fly::codec::{Codec, SigningKey};
use standoff_fly::command;

fn main() {
    let messages: [MavMessage; 11] = [
        command::heartbeat(),
        command::roll(1, 0.5),
        command::airspeed(1, 23.5),
        command::altitude(1, 150.0),
        command::circle(1, [474_000_000, 85_000_000], 120.0, 80.0, true),
        command::message_interval(1, 33, 100_000),
        command::read_parameter(1, "ROLL_LIMIT_DEG"),
        command::course(1, -1.0, 15.0),
        command::request_fence(1),
        command::request_fence_item(1, 4),
        command::fence_received(1),
    ];
    let key = SigningKey { key: [0x2a; 32], link_id: 5 };
    for signing in [None, Some(&key)] {
        let mut codec = Codec::new(1, signing);
        for message in &messages {
            let digits: String = codec.encode(message).iter().map(|byte| format!("{byte:02x}")).collect();
            println!("{digits}");
        }
    }
}
