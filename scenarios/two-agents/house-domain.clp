;;; The domain model, and the facts that the robots share.

(deftemplate room "A room, and the mutex of the room as a resource."
  (slot name (type SYMBOL))
  (slot number (type INTEGER))  ; robots clean the room with the smallest number first
  (slot mutex (type SYMBOL)))

(defglobal
  ?*ROOMS* = (create$ kitchen bath hall study))

(defrule house-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded)))

(defrule house-domain-facts
  "Assert the rooms, none of which is clean at first, share the facts about them with the other robot,
   and request control of this robot's Skiller."
  (domain-loaded)
  (wm-fact (id "/cx/identity") (value ?me))
  (not (domain-facts-loaded))
  =>
  (progn$ (?room ?*ROOMS*)
    (assert (room (name ?room) (number ?room-index) (mutex (resource-to-mutex ?room)))))
  (wm-robmem-sync-enable "/domain/fact/swept" "/domain/fact/mopped")
  (blackboard-open-reading "SkillerInterface" ?me)
  (assert (skiller-control (skiller ?me))
          (domain-facts-loaded)))

(deffunction house-is (?state ?object)
  "Return whether the object, a room or a robot, is known to be in the state: swept, mopped or full."
  (any-factp ((?fact domain-fact))
    (and (eq ?fact:name ?state) (eq ?fact:param-values (create$ ?object)))))

(deffunction house-has-shared-fact (?id)
  "Return whether the robot memory has the wm-fact with this id."
  (bind ?query (bson-create))
  (bson-append ?query "_id" ?id)
  (bind ?cursor (robmem-query ?*WM-ROBMEM-SYNC-COLLECTION* ?query))
  (bson-destroy ?query)
  (if (not ?cursor) then (return FALSE))
  (bind ?document (robmem-cursor-next ?cursor))
  (if ?document then (bson-destroy ?document))
  (robmem-cursor-destroy ?cursor)
  (neq ?document FALSE))

(deffunction house-share (?room)
  "Send the facts of a room that the robot memory lacks, e.g. after its restart.
   Return whether it lacked none."
  (bind ?shared TRUE)
  (do-for-all-facts ((?fact wm-fact))
    (and (wm-key-prefix ?fact:key (create$ domain fact)) (eq (wm-key-arg ?fact:key room) ?room))
    (if (not (house-has-shared-fact ?fact:id)) then
      (wm-robmem-sync-fact-update ?fact (cx-identity) (wm-robmem-sync-now))
      (bind ?shared FALSE)))
  ?shared)
