// SPDX-License-Identifier: Apache-2.0
// usage: node decode.cjs FILE.dbc LOG.candump      CSV on standard output: utime,message,signal,value
//
// Knows nothing of Farpoint but the DBC file: value is in the DBC's units, empty where the signal's value table calls
// the raw value 'not available'.
'use strict';
const fs = require('fs');
const path = require('path');
// The package lies where npm ci put it, not beside this file.
const { Dbc, Can } = require(path.join(process.env.CANDIED_HOME, 'node_modules', 'candied'));

function fail(message) {
  process.stderr.write(`decode.cjs: ${message}\n`);
  process.exit(1);
}

const [dbcPath, logPath] = process.argv.slice(2);
if (!logPath) fail('expected a DBC file and a candump log');
const dbc = new Dbc();
const data = dbc.load(fs.readFileSync(dbcPath, 'utf8'));
if (dbc.errors && dbc.errors.size > 0) fail(`${dbcPath}: syntax errors in lines ${[...dbc.errors.keys()].join(' ')}`);
const can = new Can();
can.database = data;

const out = ['utime,message,signal,value'];
for (const line of fs.readFileSync(logPath, 'utf8').split('\n')) {
  if (line === '') continue;
  const match = line.match(/^\((\d+)\.(\d{6})\) \S+ ([0-9A-F]{3})#((?:[0-9A-F]{2})+)$/);
  if (!match) fail(`${logPath}: not a candump line: ${line}`);
  const utime = BigInt(match[1]) * 1000000n + BigInt(match[2]);
  const payload = match[4].match(/../g).map((byte) => parseInt(byte, 16));
  const message = can.decode(can.createFrame(parseInt(match[3], 16), payload));
  if (!message) fail(`${logPath}: no message in the DBC for ${line}`);
  for (const [name, signal] of message.boundSignals) {
    const { factor, offset, valueTable } = signal.boundData.signal;
    const missing = valueTable && valueTable.get(signal.rawValue) === 'not available';
    const value = missing ? '' : signal.rawValue * factor + offset;
    out.push(`${utime},${message.name},${name},${value}`);
  }
}
process.stdout.write(out.join('\n') + '\n');
