// cleanup: what a test must undo at its end, the last thing first; every step runs, and the first error is the test's.

const stacks = new WeakMap();

export function cleanup(t, undo) {
  if (!stacks.has(t)) {
    const stack = [];
    stacks.set(t, stack);
    t.after(async () => {
      const errors = [];
      while (stack.length > 0) await Promise.resolve().then(stack.pop()).catch((error) => errors.push(error));
      if (errors.length > 0) throw errors[0];
    });
  }
  stacks.get(t).push(undo);
}
