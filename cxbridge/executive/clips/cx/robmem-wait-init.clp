; Waits until both replica sets of the robot memory run. An entry of stage-1 loads this file as
; BATCH|robmem-wait-init.clp, since the file has commands, and has the key wait-for with the value
; robmem-initialized. The rules have Fawkes' names.

(blackboard-open-reading "MongoDBManagedReplicaSetInterface" "robot-memory-local")
(blackboard-open-reading "MongoDBManagedReplicaSetInterface" "robot-memory-distributed")

(defrule robmem-wait-init-local-ok
  (MongoDBManagedReplicaSetInterface (id "robot-memory-local")
                                     (primary_status HAVE_PRIMARY)
                                     (member_status PRIMARY|SECONDARY))
  (not (robmem-wait-init-finished))
  (not (executive-init-signal (id robmem-initialized-local)))
  =>
  (assert (executive-init-signal (id robmem-initialized-local)))
  (printout t "Replica set robot-memory-local is up" crlf)
)

(defrule robmem-wait-init-distributed-ok
  (MongoDBManagedReplicaSetInterface (id "robot-memory-distributed")
                                     (primary_status HAVE_PRIMARY)
                                     (member_status PRIMARY|SECONDARY))
  (not (robmem-wait-init-finished))
  (not (executive-init-signal (id robmem-initialized-distributed)))
  =>
  (assert (executive-init-signal (id robmem-initialized-distributed)))
  (printout t "Replica set robot-memory-distributed is up" crlf)
)

(defrule robmem-wait-init-all-ok
  "Assert the awaited signal only once (robmem-wait-init-finished), because the rule that
   waits for the signal retracts a single signal."
  ?local <- (executive-init-signal (id robmem-initialized-local))
  ?distributed <- (executive-init-signal (id robmem-initialized-distributed))
  =>
  (printout t "Both replica sets are up" crlf)
  (assert (robmem-wait-init-finished)
          (executive-init-signal (id robmem-initialized)))
  (retract ?local ?distributed)
)
