// jobs: the state machine of server/DESIGN.md as a model that knows as much as a client can: for each job the set of states that it may be in.
// Why sets: a job ends by itself at any time, a queued one starts, a wish is carried out when the runner comes to it. An answer narrows the set; an
//           answer that no state in the set can give is a mistake of the server.
// States here: those of a job, and `pausing`, `cancelling`: running, with a wish that is stored and not yet carried out.
import assert from 'node:assert/strict';
import { isDeepStrictEqual } from 'node:util';

export const terminal = ['succeeded', 'failed', 'cancelled'];

/** What happens without being asked. Nothing here fails but a verification whose target is gone: no job of the test comes near a limit. */
const alone = {
  queued: ['running'],
  running: ['succeeded'],
  pausing: ['paused', 'succeeded'],
  cancelling: ['cancelled', 'succeeded'],
};
const shown = (state) => (state === 'pausing' || state === 'cancelling' ? 'running' : state);

/** {command: {state: [[status, state after], ...]}}. 409 changes nothing. */
const commands = {
  cancel: {
    queued: [[202, 'cancelled']],
    running: [[202, 'cancelling']],
    pausing: [[202, 'cancelling']],
    cancelling: [
      [202, 'cancelling'],
      [200, 'cancelling'],
    ],
    paused: [[202, 'cancelled']],
    cancelled: [[200, 'cancelled']],
    succeeded: [[409, 'succeeded']],
    failed: [[409, 'failed']],
  },
  pause: {
    queued: [[202, 'paused']],
    running: [[202, 'pausing']],
    pausing: [
      [202, 'pausing'],
      [200, 'pausing'],
    ],
    cancelling: [[409, 'cancelling']],
    paused: [[200, 'paused']],
    cancelled: [[409, 'cancelled']],
    succeeded: [[409, 'succeeded']],
    failed: [[409, 'failed']],
  },
  resume: {
    // A pause under way is waited for, and then resumed; if that takes too long the answer is 200 and the pause stands.
    queued: [[200, 'queued']],
    running: [[200, 'running']],
    pausing: [
      [202, 'queued'],
      [200, 'pausing'],
    ],
    cancelling: [[409, 'cancelling']],
    paused: [[202, 'queued']],
    cancelled: [[409, 'cancelled']],
    succeeded: [[409, 'succeeded']],
    failed: [[409, 'failed']],
  },
};

export class Job {
  /** `ends`: whether it can come to its end by itself. `target`: what a verification looks at. `last`: events that it begins with. */
  constructor(id, { ends, body, kind = 'colony', target, last = 0 }) {
    Object.assign(this, { id, ends, body, kind, target, last, digest: undefined, ended: undefined, gone: false });
    this.states = this.closed(['queued']);
  }

  /** The states and all that may follow from them by themselves. */
  closed(states) {
    const all = new Set(states);
    for (const state of all) {
      for (const next of alone[state] ?? []) {
        if (this.ends || next !== 'succeeded') all.add(next);
        // Nothing is left to verify.
        if (next === 'succeeded' && this.target?.gone) all.add('failed');
      }
    }
    return all;
  }

  /** It was deleted. */
  remove(jobs) {
    this.gone = true;
    for (const job of jobs) if (job.target === this) job.states = job.closed(job.states);
  }

  /** It was edited: nothing else may have changed. */
  edited(json, change) {
    const before = this.ended;
    this.ended = undefined;
    this.seen(json, 'an edit');
    for (const [name, value] of Object.entries(change)) assert.deepEqual(json[name], value, `the ${name} that was asked for`);
    if (before) assert.deepEqual({ ...json, revision: 0 }, { ...before, ...change, revision: 0 }, 'an edit changes nothing else');
    if (before) assert.ok(json.revision >= before.revision && json.revision <= before.revision + 1, 'a revision grows by one');
  }

  toString() {
    return `${this.id} {${[...this.states].join(' ')}}`;
  }

  narrow(states, what) {
    assert.ok(states.length > 0, `${what}: no state of ${this} allows it`);
    this.states = this.closed(states);
  }

  /** A command was answered. */
  commanded(name, { status, json, text }) {
    const what = `${name} -> ${status} ${status < 300 ? json.state : text}`;
    let after = [...this.states].flatMap((state) =>
      commands[name][state].filter(([stated]) => stated === status).map(([, next]) => next),
    );
    if (status < 300) {
      this.narrow(after, what);
      this.seen(json, what);
    } else {
      assert.deepEqual([status, json.type], [409, 'urn:colony:problem:job-terminal'], what);
      this.narrow(after, what);
    }
  }

  /** Its whole view, as a look at it or a command gives it. */
  seen(json, what = 'a look') {
    assert.equal(json.id, this.id);
    this.narrow(
      [...this.states].filter((state) => shown(state) === json.state),
      `${what}: it is ${json.state}`,
    );
    assert.ok(json.last_seq >= this.last, `${what}: event ${this.last} of ${this} was there, now ${json.last_seq}`);
    if (json.last_seq === this.last && this.digest)
      assert.equal(json.digest, this.digest, `${what}: the digest of event ${this.last} of ${this}`);
    [this.last, this.digest] = [json.last_seq, json.digest];
    if (this.ended)
      assert.ok(
        isDeepStrictEqual(json, this.ended),
        `${what}: a finished job changed:\n${JSON.stringify(this.ended)}\n${JSON.stringify(json)}`,
      );
    if (terminal.includes(json.state)) this.ended = json;
    if (json.state === 'paused') assert.equal(json.reason, 'user', what);
    if (this.kind === 'verify' && json.state === 'succeeded')
      assert.equal(json.result.identical, true, `${what}: ${this} does not find what was grown`);
  }

  get mayBeRemoved() {
    return [...this.states].some((state) => terminal.includes(state));
  }
  get mayStay() {
    return [...this.states].some((state) => !terminal.includes(state));
  }

  /** Events after `after`, complete up to the end of what was stored. */
  history(events, after) {
    events.forEach(({ seq }, index) => assert.equal(seq, after + index + 1, `the events of ${this} are dense`));
    const known = events.find(({ seq }) => seq === this.last);
    if (known && known.kind !== 'finished') assert.equal(known.digest, this.digest, `event ${this.last} of ${this} changed`);
    const last = events.at(-1);
    if (!last) return;
    assert.ok(last.seq >= this.last, `events of ${this} are missing: ${last.seq} of ${this.last}`);
    [this.last, this.digest] = [last.seq, last.digest];
    const finished = events.findIndex(({ kind }) => kind === 'finished');
    if (finished < 0) {
      assert.ok(!this.ended, `${this} has ended without its last event`);
      return;
    }
    assert.equal(finished, events.length - 1, `nothing follows the end of ${this}`);
    this.narrow(
      [...this.states].filter((state) =>
        last.reason === 'cancelled' ? state === 'cancelled' : state === 'succeeded' || state === 'failed',
      ),
      `it finished: ${last.reason}`,
    );
  }
}
