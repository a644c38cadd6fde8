// The work under way: one job at a time, told of while it runs.
import { Foreign } from './foreign';
import type { State, Store } from './state';

export interface Jobs {
  readonly areRunning: boolean;
  /** Runs one job to its end, in place of the one before; what it throws becomes the message on the page, unless it was cancelled. */
  run(trouble: string, work: (step: Step) => Promise<void>): Promise<void>;
  cancel(): void;
}

export interface Step {
  signal: AbortSignal;
  /** Names what runs now; returns the receiver of its progress. */
  begin(title: string): (progress: { phase: string; fraction: number }) => void;
}

/** `ended` is what changes besides when a job ends, however it does. */
export function createJobs(store: Store, ended: () => Partial<State>): Jobs {
  let current: AbortController | undefined;

  function end(): void {
    current = undefined;
    store.set({ job: undefined, ...ended() });
  }

  return {
    get areRunning() {
      return current !== undefined;
    },
    async run(trouble, work) {
      current?.abort();
      const mine = new AbortController();
      current = mine;
      const tell = (title: string, phase: string, fraction: number | undefined) => {
        if (current === mine) store.set({ job: { title, phase, fraction } });
      };
      store.set({ error: undefined });
      try {
        await work({
          signal: mine.signal,
          begin(title) {
            tell(title, '', undefined);
            return ({ phase, fraction }) => tell(title, phase, fraction);
          },
        });
      } catch (error) {
        if (!mine.signal.aborted) store.set({ error: messageOf(trouble, error) });
      }
      if (current === mine) end();
    },

    cancel() {
      current?.abort();
      end();
    },
  };
}

export function messageOf(trouble: string, error: unknown): string {
  const message = error instanceof Error ? error.message : String(error);
  return `${trouble}${error instanceof Foreign ? '' : ':'} ${message}`;
}
