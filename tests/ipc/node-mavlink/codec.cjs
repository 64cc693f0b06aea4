// SPDX-License-Identifier: Apache-2.0
// usage: node codec.cjs decode FRAMES       a line of JSON on standard output for each MAVLink frame of the file
//        node codec.cjs encode FRAMES       frames for the project's parser into the file: see below
//
// Knows nothing of Farpoint: names, order and types of fields come from the dialect's definition, checksums are
// checked.
'use strict';
const fs = require('fs');
const path = require('path');
const { PassThrough } = require('stream');
// The packages lie where npm ci put them, not beside this file.
const modules = path.join(process.env.MAVLINK_HOME, 'node_modules');
const { MavLinkPacketSplitter, MavLinkPacketParser, MavLinkProtocolV1, MavLinkProtocolV2 } =
  require(path.join(modules, 'node-mavlink'));
const { minimal, common } = require(path.join(modules, 'mavlink-mappings'));
const registry = { ...minimal.REGISTRY, ...common.REGISTRY };

function text(key, value) {
  if (typeof value === 'bigint') return value.toString();
  if (typeof value === 'number' && Number.isNaN(value)) return 'NaN';
  return value;
}

function decode(file) {
  const source = new PassThrough();
  const parser = source.pipe(new MavLinkPacketSplitter()).pipe(new MavLinkPacketParser());
  parser.on('data', (packet) => {
    const kind = registry[packet.header.msgid];
    if (!kind) throw new Error(`no message ${packet.header.msgid} in the dialect`);
    const line = {
      id: packet.header.msgid, name: kind.MSG_NAME, magic: packet.header.magic, system: packet.header.sysid,
      component: packet.header.compid, sequence: packet.header.seq, length: packet.header.payloadLength,
      fields: packet.protocol.data(packet.payload, kind),
    };
    process.stdout.write(JSON.stringify(line, text) + '\n');
  });
  source.end(fs.readFileSync(file));
}

// Noise, an autopilot's HEARTBEAT of version 1, a message that Farpoint does not take, a TIMESYNC request of version 2
// and one of version 1, and the answer 123456789012345 to a request of 987654321.
function encode(file) {
  const autopilot = [new MavLinkProtocolV1(1, 1), new MavLinkProtocolV2(1, 1)];
  const make = (protocol, kind, fields, sequence) =>
    protocol.serialize(Object.assign(new kind(), fields), sequence);
  const attitude = { timeBootMs: 1234, roll: 0.1, pitch: 0.2, yaw: 0.3 };
  fs.writeFileSync(file, Buffer.concat([
    Buffer.from([0x00, 0xfd, 0x03, 0xfe, 0x41]),
    make(autopilot[0], minimal.Heartbeat, { type: 2, autopilot: 12, systemStatus: 4, mavlinkVersion: 3 }, 0),
    make(autopilot[1], common.Attitude, attitude, 1),
    make(autopilot[1], common.TimeSync, { tc1: 0n, ts1: 5000000001n }, 2),
    make(autopilot[0], common.TimeSync, { tc1: 0n, ts1: 5000000002n }, 3),
    make(autopilot[1], common.TimeSync, { tc1: 123456789012345n, ts1: 987654321n }, 4),
  ]));
}

const [what, file] = process.argv.slice(2);
({ decode, encode })[what](file);
