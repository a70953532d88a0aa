;;; Time: two integers, seconds and microseconds, as in (time 1700000000 250000).
;;;
;;; The host asserts a (time SEC USEC) fact before each run of the rules, if it is configured
;;; to; the rule time-retract retracts the fact after all other rules.

(defglobal ?*PRIORITY-TIME-RETRACT* = -10000)  ; after all other rules

(deffunction time-diff (?t1 ?t2)
  "t1 - t2 as (SEC USEC) with 0 <= USEC < 1000000; SEC carries the sign."
  (bind ?seconds (- (nth$ 1 ?t1) (nth$ 1 ?t2)))
  (bind ?micros (- (nth$ 2 ?t1) (nth$ 2 ?t2)))
  (if (>= ?micros 0) then (return (create$ ?seconds ?micros)))
  (create$ (- ?seconds 1) (+ ?micros 1000000)))

(deffunction time-diff-sec (?t1 ?t2)
  "t1 - t2 in seconds, a float."
  (bind ?diff (time-diff ?t1 ?t2))
  (+ (float (nth$ 1 ?diff)) (/ (nth$ 2 ?diff) 1000000.0)))

(deffunction timeout (?now ?time ?timeout)
  "TRUE if MORE than ?timeout seconds have passed since ?time."
  (< ?timeout (time-diff-sec ?now ?time)))

(deffunction time> (?t1 ?t2)
  "TRUE if t1 is strictly later than t2."
  (bind ?ahead (- (nth$ 1 ?t1) (nth$ 1 ?t2)))
  (or (> ?ahead 0)
      (and (= ?ahead 0) (> (nth$ 2 ?t1) (nth$ 2 ?t2)))))

(deffunction time-trunc-ms (?time)
  "The time (SEC USEC), rounded down to a millisecond. An argument without two fields is returned unchanged."
  (if (<> 2 (length$ ?time)) then (return ?time))
  (bind ?micros (nth$ 2 ?time))
  (create$ (nth$ 1 ?time) (- ?micros (mod ?micros 1000))))

;; For periodic work: match the timer and the time fact with (timeout ?now ?t PERIOD),
;; then modify the time of the timer (and seq, to count the periods).
(deftemplate timer "The last time of periodic work, and the number of its repetitions."
  (slot name)
  (multislot time
    (type INTEGER) (cardinality 2 2) (default-dynamic (now)))
  (slot seq
    (type INTEGER) (default 1)))

(defrule time-retract
  "Retract the time fact at the end of a run."
  (declare (salience ?*PRIORITY-TIME-RETRACT*))
  ?time <- (time $?)
  =>
  (retract ?time))
